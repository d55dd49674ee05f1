"""Mains hum: a line at 50 or 60 Hz, or a multiple, that no excitation made."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from recordings.run import DeviceSamples, Run, pieces
from recordings.sweeps import Stretch, measured_stretches
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.hum_in_noise import line_in_noise
from twin.diagnose.signals.limits import LIMITS
from twin.diagnose.signals.remainder import remainders

CANDIDATES_Hz = (50.0, 60.0, 100.0, 120.0, 150.0, 180.0)
MOST_STEPS, LEAST_STEPS = 24, 12


def find_mains_hum(runs: Sequence[Run]) -> list[Finding]:
    """Channels with a mains line in their sine steps; where too few of these can tell, in the broadband runs."""
    stretches = [(run, stretch) for run in runs for stretch in measured_stretches(run)]
    noise = [(run, stretch) for run, stretch in stretches if not stretch.step.frequency_Hz > 0]
    stretches = [(run, stretch) for run, stretch in stretches if stretch.step.frequency_Hz > 0]
    stretches = stretches[:: max(1, len(stretches) // MOST_STEPS)]
    findings = []
    each = [_lines(device, stretch) for run, stretch in stretches for device in run.devices.values()]
    for channel in runs[0].channels:
        seen = [lines[channel] for lines in each if channel in lines]
        best: tuple[float, float, float] | None = None
        for k, frequency in enumerate(CANDIDATES_Hz):
            pairs = np.array([lines[k] for lines in seen if np.isfinite(lines[k]).all()])
            found = _in_steps(pairs) if len(pairs) >= LEAST_STEPS else _in_noise(noise, channel, frequency)
            if found is not None and (best is None or found[0] > best[1]):
                best = (frequency, *found)
        if best is not None:
            frequency, amplitude, std = best
            findings.append(
                Finding(
                    cause="mains-hum",
                    summary=f"{channel} hums at {frequency:g} Hz with an amplitude of {amplitude:.3g}",
                    values={"frequency_Hz": frequency, "amplitude": amplitude},
                    std={"frequency_Hz": 0.05, "amplitude": std},
                    names={"channel": channel},
                )
            )
    return findings


def _in_steps(pairs: NDArray[np.float64]) -> tuple[float, float] | None:
    """Amplitude and standard deviation of a line from its amplitude and noise in each step; None if there is none."""
    # The median of an exponential variable is ln 2 times its mean.
    power = float(np.median((pairs[:, 0] / pairs[:, 1]) ** 2) / np.log(2))
    amplitude = float(np.median(pairs[:, 0]))
    return (amplitude, amplitude / np.sqrt(power * len(pairs))) if power > LIMITS.mains_hum_least_power else None


def _in_noise(
    stretches: Sequence[tuple[Run, Stretch]], channel: str, frequency_Hz: float
) -> tuple[float, float] | None:
    """The same from the broadband run in which it is surest."""
    seen = [line_in_noise(run, stretch, channel, frequency_Hz) for run, stretch in stretches]
    clear = [
        line
        for line in seen
        if line is not None and line[0] ** 2 > LIMITS.mains_hum_least_power_in_noise * 2 * line[1] ** 2
    ]
    return min(clear, key=lambda line: line[1]) if clear else None


def _lines(device: DeviceSamples, stretch: Stretch) -> dict[str, NDArray[np.float64]]:
    """Of each channel without lost samples: amplitude of each candidate line and of the noise beside it.

    Arrays (candidates, 2); NaN near the drive's harmonics.
    """
    first, stop = device.position_at(stretch.start_ns), device.position_at(stretch.stop_ns)
    count, rate, drive = stop - first, device.sample_rate_Hz, stretch.step.frequency_Hz
    names = [name for name, x in device.values.items() if all(np.isfinite(p).all() for p in pieces(x, first, stop))]
    if count < 64 or not names:
        return {}
    length = count / rate
    orders = np.arange(1, int(min(0.45 * rate / drive, 20)) + 1)
    apart_Hz = np.array([abs(f / drive - round(f / drive)) * drive for f in CANDIDATES_Hz])
    seen = np.flatnonzero((apart_Hz * length >= 1.5) & (np.array(CANDIDATES_Hz) <= 0.45 * rate))
    lines = np.array(CANDIDATES_Hz)[seen]
    near = lines[:, None] + np.array([-7, -6, -5, -4, -3, 3, 4, 5, 6, 7]) / length

    def values(at: NDArray[np.int64]) -> NDArray[np.float64]:
        """Samples, and the columns of the lines: of one beside the drive's some is taken off with that."""
        turn = 2 * np.pi * lines * (at[:, None] / rate)
        taken = slice(first + at[0], first + at[-1] + 1)
        return np.column_stack([*(device.values[name][taken] for name in names), np.cos(turn), np.sin(turn)])

    def drives(at: NDArray[np.int64]) -> NDArray[np.float64]:
        t = at[:, None] / rate
        angle = 2 * np.pi * drive * t * orders
        return np.hstack([np.cos(angle), np.sin(angle), np.ones_like(t), t])

    own = len(names)
    products, beside = np.zeros(()), np.zeros(())
    for at, left in remainders(count, values, drives):
        products = products + left.T @ left
        beside = beside + np.exp(-2j * np.pi * near.reshape(-1, 1) * (at / rate)) @ left[:, :own]
    out = np.full((own, len(CANDIDATES_Hz), 2), np.nan)
    for k, place in enumerate(seen, start=own):
        pair = [k, k + len(lines)]
        out[:, place, 0] = np.hypot(*np.linalg.solve(products[np.ix_(pair, pair)], products[pair, :own]))
    noise = 2 * np.abs(np.reshape(beside, (*near.shape, own))) / count
    out[:, seen, 1] = np.sqrt(np.mean(noise**2, axis=1)).T + 1e-300
    return dict(zip(names, out, strict=True))
