"""Broadband runs: spectral lines of the whole record, and H1 with coherence for the eye."""

import tomllib
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal

from recordings.errors import InputError
from recordings.run import Run
from recordings.sweeps import sweeps
from twin.identify.gaps import fill_gaps
from twin.identify.limits import LIMITS


@dataclass(frozen=True, kw_only=True)
class BroadbandRecord:
    """Simultaneous samples of one broadband stretch.

    Attributes
    ----------
    time_s : float
        Of the stretch's middle, on the recording's own time base.
    samples : dict of ndarray
        Each channel's samples, all of one length, in its unit.
    missing : dict of ndarray
        Positions of the samples that were missing, of each channel that lacks some; they were filled in
        (:mod:`twin.identify.gaps`).
    late_s : dict of float
        How much later than the stretch's start each channel's first sample was taken, by its device's clock.
    """

    run: str
    sweep: str
    time_s: float
    sample_rate_Hz: float
    samples: dict[str, NDArray[np.float64]]
    missing: dict[str, NDArray[np.intp]] = field(default_factory=dict)
    late_s: dict[str, float] = field(default_factory=dict)

    @property
    def lost(self) -> int:
        """Samples that were missing, of all channels."""
        return sum(map(len, self.missing.values()))

    @property
    def duration_s(self) -> float:
        """Length of the record."""
        return len(next(iter(self.samples.values()))) / self.sample_rate_Hz

    def lines(self, channel: str, band_Hz: tuple[float, float]) -> tuple[NDArray[Any], NDArray[Any]]:
        """Frequencies and complex amplitudes (peak values) of the DFT lines within a band; a mean is none of them."""
        x = self.samples[channel]
        frequency = np.fft.rfftfreq(len(x), 1 / self.sample_rate_Hz)
        inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1]) & (frequency > 0)
        turn = np.exp(-2j * np.pi * frequency * self.late_s.get(channel, 0.0))
        return frequency[inside], (2 * np.fft.rfft(x) / len(x) * turn)[inside]


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse:
    """H1 estimate with coherence: response per force, in unit/N; `averages` as many independent ones would be worth."""

    frequency_Hz: NDArray[np.float64]
    H: dict[str, NDArray[np.complex128]]
    coherence: dict[str, NDArray[np.float64]]
    averages: int


def broadband_records(
    run: Run, *, channels: Sequence[str] | None = None, impacts: bool = False
) -> list[BroadbandRecord]:
    """The measured broadband stretches of `run`.

    Parameters
    ----------
    channels
        What is wanted; by default all that are sampled as fast as the first one.
    impacts
        Take the hits of an impact test; they are no noise, nor need they all be at the rig's drive.

    Raises
    ------
    InputError
        If it is an impact test and these are not wanted, channels that are asked for are not sampled alike, or one of
        them lost all samples of a stretch.
    """
    if not impacts and is_impact_test(run):
        raise InputError(run.path, "procedure.toml", "is an impact test", "take it to 'twin modes'")
    rates = {name: run.device_of(name).sample_rate_Hz for name in channels or run.channels}
    rate = next(iter(rates.values()), 0.0)
    names = [name for name, value in rates.items() if value == rate]
    records = []
    for sweep in sweeps(run):
        for stretch in sweep.stretches:
            if stretch.step.frequency_Hz > 0:
                continue
            if channels is not None and len(names) < len(rates):
                told = ", ".join(f"{name} {value:g}" for name, value in rates.items())
                reason = f"their sample rates differ (Hz: {told}) in the broadband sweep {sweep.name}"
                raise InputError(run.path, "channels", reason, "record them at one rate, or leave the run out")
            cut, late = {}, {}
            for name in names:
                device = run.device_of(name)
                first, last = device.position_at(stretch.start_ns), device.position_at(stretch.stop_ns)
                cut[name] = device.values[name][first:last].astype(float)
                late[name] = float(device.times_ns(first, first + 1)[0] - stretch.start_ns) * 1e-9
            length = min(len(x) for x in cut.values())
            if length < 64:
                continue
            missing: dict[str, NDArray[np.intp]] = {}
            for name, x in cut.items():
                x = x[:length]
                absent = np.flatnonzero(~np.isfinite(x))
                if len(absent):
                    missing[name] = absent
                if len(absent) == length:
                    place = f"channel {name}"
                    raise InputError(
                        run.path, place, f"every sample of sweep {sweep.name} was lost", "leave the run out"
                    )
                cut[name] = fill_gaps(x)
            records.append(
                BroadbandRecord(
                    run=run.path,
                    sweep=sweep.name,
                    time_s=(stretch.start_ns + stretch.stop_ns) / 2 * 1e-9,
                    sample_rate_Hz=rate,
                    samples=cut,
                    missing=missing,
                    late_s=late,
                )
            )
    return records


def is_impact_test(run: Run) -> bool:
    """Whether the procedure that a run brings along is one of hits."""
    try:
        table = tomllib.loads(run.attachments.get("procedure.toml", b"").decode())
    except ValueError:
        return False
    return table.get("procedure") == "impact"


def h1(record: BroadbandRecord, *, force: str, resolution_Hz: float = 0.25) -> FrequencyResponse:
    """H1 = S_fx / S_ff by Welch's method with a Hann window."""
    length = int(min(len(record.samples[force]), record.sample_rate_Hz / resolution_Hz))
    options = {"fs": record.sample_rate_Hz, "nperseg": length, "window": "hann"}
    f = record.samples[force]
    frequency, S_ff = signal.welch(f, **options)
    H, coherence = {}, {}
    for name, x in record.samples.items():
        if name == force:
            continue
        S_fx = signal.csd(f, x, **options)[1]
        S_xx = signal.welch(x, **options)[1]
        turn = np.exp(-2j * np.pi * frequency * (record.late_s.get(name, 0.0) - record.late_s.get(force, 0.0)))
        H[name] = S_fx / np.maximum(S_ff, np.finfo(float).tiny) * turn
        coherence[name] = np.abs(S_fx) ** 2 / np.maximum(S_ff * S_xx, np.finfo(float).tiny)
    segments = 1 + (len(f) - length) // (length - length // 2)
    worth = max(1, int(segments / (1 + 2 * LIMITS.spectrum_overlapping**2)))
    return FrequencyResponse(frequency_Hz=frequency, H=H, coherence=coherence, averages=worth)
