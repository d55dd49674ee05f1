"""Broadband runs: spectral lines of a record or of its parts, and H1 with coherence for the eye."""

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy import fft, signal

from recordings.errors import InputError
from recordings.run import PIECE, Run, Samples
from recordings.sweeps import Stretch, sweeps
from twin.arrays import Array
from twin.identify.limits import LIMITS
from twin.identify.spectra.gaps import fill_gaps


class _Cut(Mapping[str, Array]):
    """Some of the samples of channels, read and without gaps, each time that they are asked for."""

    def __init__(self, stored: Mapping[str, tuple[Samples, int]], length: int) -> None:
        self._stored, self.length = stored, length

    def __getitem__(self, name: str) -> Array:
        samples, first = self._stored[name]
        return fill_gaps(samples[first : first + self.length].astype(float))

    def __iter__(self) -> Iterator[str]:
        return iter(self._stored)

    def __len__(self) -> int:
        return len(self._stored)

    def part(self, start: int, length: int) -> "_Cut":
        """Fewer of them."""
        return _Cut({name: (samples, first + start) for name, (samples, first) in self._stored.items()}, length)

    def missing(self) -> dict[str, NDArray[np.intp]]:
        """Positions of those that were lost, of channels that lack some."""
        found: dict[str, list[NDArray[np.intp]]] = {}
        for at in range(0, self.length, PIECE):
            for name, (samples, first) in self._stored.items():
                piece = samples[first + at : first + min(at + PIECE, self.length)]
                if len(lost := np.flatnonzero(~np.isfinite(piece))):
                    found.setdefault(name, []).append(at + lost)
        return {name: np.concatenate(lost) for name, lost in found.items()}


@dataclass(frozen=True, kw_only=True)
class BroadbandRecord:
    """Simultaneous samples of one broadband stretch."""

    run: str
    sweep: str
    time_s: float
    """Of the stretch's middle, on the recording's own time base."""
    sample_rate_Hz: float
    samples: Mapping[str, Array]
    """Each channel's samples, all of one length, in its unit; they may be read each time that they are asked for."""
    missing: dict[str, NDArray[np.intp]] = field(default_factory=dict)
    """Positions of the samples that were missing, of each channel that lacks some; they were filled in
    (:mod:`twin.identify.spectra.gaps`)."""
    late_s: dict[str, float] = field(default_factory=dict)
    """How much later than the stretch's start each channel's first sample was taken, by its device's clock."""

    @property
    def length(self) -> int:
        """Samples of a channel."""
        return self.samples.length if isinstance(self.samples, _Cut) else len(next(iter(self.samples.values())))

    @property
    def duration_s(self) -> float:
        """Length of the record."""
        return self.length / self.sample_rate_Hz

    @property
    def part_length(self) -> int:
        """Samples of each of :meth:`parts`: a length whose transform needs little time and memory."""
        count = max(1, -(-self.length // LIMITS.spectrum_samples))
        return int(fft.prev_fast_len(max(1, self.length // count), real=True))

    def parts(self) -> Iterator["BroadbandRecord"]:
        """The record in as few pieces of one length as memory holds one by one: itself, if it is not long.

        The few samples that remain belong to none; nor do pieces of which a channel lost every sample.
        """
        length = self.part_length
        pieces = (self.piece(start, length) for start in range(0, self.length - length + 1, length))
        return (piece for piece in pieces if piece.heard)

    def piece(self, start: int, length: int) -> "BroadbandRecord":
        """A shorter one."""
        samples, stop = self.samples, start + length
        missing = {
            name: lost[slice(*np.searchsorted(lost, [start, stop]))] - start for name, lost in self.missing.items()
        }
        return replace(
            self,
            samples=samples.part(start, length)
            if isinstance(samples, _Cut)
            else {name: x[start:stop] for name, x in samples.items()},
            missing={name: lost for name, lost in missing.items() if len(lost)},
        )

    @property
    def heard(self) -> bool:
        """Whether every channel has some sample."""
        return all(len(lost) < self.length for lost in self.missing.values())

    def lines(self, channel: str, band_Hz: tuple[float, float]) -> tuple[Array, Array]:
        """Frequencies and complex amplitudes (peak values) of the DFT lines within a band; a mean is none of them."""
        frequency = np.fft.rfftfreq(self.length, 1 / self.sample_rate_Hz)
        inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1]) & (frequency > 0)
        frequency = frequency[inside]
        turn = np.exp(-2j * np.pi * frequency * self.late_s.get(channel, 0.0))
        return frequency, 2 * np.fft.rfft(self.samples[channel])[inside] / self.length * turn


@dataclass(frozen=True, kw_only=True)
class FrequencyResponse:
    """H1 estimate with coherence: response per force, in unit/N; `averages` as many independent ones would be worth.

    `density` is that of the power of each channel, the force's too, unit^2/Hz.
    """

    frequency_Hz: Array
    H: dict[str, Array]
    coherence: dict[str, Array]
    density: dict[str, Array]
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
            records.append(_record(run, names, stretch, rate))
    return [record for record in records if record.length >= 64]


def _record(run: Run, names: Sequence[str], stretch: Stretch, rate_Hz: float) -> BroadbandRecord:
    stored, late, lengths = {}, {}, []
    for name in names:
        device = run.device_of(name)
        first, last = device.position_at(stretch.start_ns), device.position_at(stretch.stop_ns)
        stored[name] = device.values[name], first
        lengths.append(last - first)
        late[name] = float(device.times_ns(first, first + 1)[0] - stretch.start_ns) * 1e-9
    cut = _Cut(stored, min(lengths))
    record = BroadbandRecord(
        run=run.path, sweep=stretch.step.sweep, time_s=(stretch.start_ns + stretch.stop_ns) / 2 * 1e-9,
        sample_rate_Hz=rate_Hz, samples=cut, missing=cut.missing(), late_s=late,
    )  # fmt: skip
    if not any(True for _ in record.parts()):
        worst = max(record.missing, key=lambda name: len(record.missing[name]))
        reason = f"every sample of sweep {record.sweep} was lost"
        raise InputError(run.path, f"channel {worst}", reason, "leave the run out")
    return record


def is_impact_test(run: Run) -> bool:
    """Whether the procedure that a run brings along is one of hits."""
    try:
        table = tomllib.loads(run.attachments.get("procedure.toml", b"").decode())
    except ValueError:
        return False
    return table.get("procedure") == "impact"


def h1(record: BroadbandRecord, *, force: str, resolution_Hz: float = 0.25) -> FrequencyResponse:
    """H1 = S_fx / S_ff by Welch's method with a Hann window."""
    length = int(min(record.part_length, record.sample_rate_Hz / resolution_Hz))
    window = signal.get_window("hann", length)
    lines, count = length // 2 + 1, 0
    power = {name: np.zeros(lines) for name in record.samples}
    cross = {name: np.zeros(lines, complex) for name in record.samples if name != force}
    for start in range(0, record.length - length + 1, length - length // 2):
        piece = record.piece(start, length)
        if not piece.heard:
            continue
        count += 1
        U = _spectrum(piece.samples[force], window)
        power[force] += np.abs(U) ** 2
        for name in cross:
            X = _spectrum(piece.samples[name], window)
            cross[name] += np.conj(U) * X
            power[name] += np.abs(X) ** 2
    frequency = np.arange(lines, dtype=float) * (record.sample_rate_Hz / length)
    tiny = float(np.finfo(float).tiny)
    coherence = {}
    for name, S_fx in cross.items():
        coherence[name] = np.abs(S_fx) ** 2 / np.maximum(power[force] * power[name], tiny)
        S_fx /= np.maximum(power[force], tiny)  # in place: of many channels there is much
        S_fx *= np.exp(-2j * np.pi * frequency * (record.late_s.get(name, 0.0) - record.late_s.get(force, 0.0)))
    sides = np.where((frequency > 0) & (2 * np.arange(lines) < length), 2.0, 1.0)
    scale = sides / (record.sample_rate_Hz * np.sum(window**2) * count)
    for S in power.values():
        S *= scale
    return FrequencyResponse(
        frequency_Hz=frequency, H=cross, coherence=coherence, density=power,
        averages=max(1, int(count / (1 + 2 * LIMITS.spectrum_overlapping**2))),
    )  # fmt: skip


def _spectrum(x: Array, window: Array) -> Array:
    """Without the mean."""
    return np.asarray(np.fft.rfft((x - np.mean(x)) * window))
