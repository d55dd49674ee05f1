"""Whether samples, time stamps and the steps' frequencies go together."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import DeviceSamples, Run
from recordings.sweeps import Stretch, sweeps
from twin.checks.finding import Finding
from twin.checks.responses import LEAST_SAMPLES, line_of
from twin.checks.thresholds import CLOCK_ERROR, ONE_STEP, RATE_ERROR
from twin.checks.units import factor_text

__all__ = ["look_at_clock"]

Array = NDArray[Any]

SCATTER = 0.05
"""Of the logarithm of the sines' frequencies over the commands, beyond which they are no sines: noise has 1."""


def look_at_clock(run: Run, *, force: str) -> list[Finding]:
    """One finding at most: whatever the clock is wrong by shows in all that follows."""
    for device in run.devices.values():
        finding = _rate(run, device)
        if finding is not None:
            return [finding]
    measured = [stretch for sweep in sweeps(run) for stretch in sweep.stretches]
    device = run.device_of(force)
    if measured and sum(_samples(device, one) < LEAST_SAMPLES for one in measured) > len(measured) / 2:
        first, last = measured[0].start_ns * 1e-9, measured[-1].start_ns * 1e-9
        begun, ended = int(device.block_time_ns[0]) * 1e-9, device.end_ns * 1e-9
        expected = f"steps within the samples' time, which is {begun:.4g} to {ended:.4g} s"
        found = f"steps from {first:.4g} to {last:.4g} s, most of them without samples"
        return [Finding(run.path, "", "clock", expected, found, "stopped")]
    sines = [sweep_of for sweep in sweeps(run) if len(sweep_of := [s for s in sweep.stretches if s.step.frequency_Hz])]
    return [finding for stretches in sines if (finding := _frequencies(run, force, stretches))][:1]


def _samples(device: DeviceSamples, stretch: Stretch) -> int:
    return device.position_at(stretch.stop_ns) - device.position_at(stretch.start_ns)


def _rate(run: Run, device: DeviceSamples) -> Finding | None:
    """The stated rate against the one that the blocks' time stamps make."""
    apart_ns = np.diff(device.block_time_ns)
    if not np.any(apart_ns > 0):
        return None
    rate = float(np.median(np.diff(device.block_start)[apart_ns > 0] / (apart_ns[apart_ns > 0] * 1e-9)))
    stated = device.sample_rate_Hz
    if rate <= 0 or abs(rate / stated - 1) < RATE_ERROR:
        return None
    expected = f"{rate:.4g} samples a second, as the blocks' time stamps say"
    found = f"device {device.device} states {stated:.4g} Hz{factor_text(stated / rate)}"
    return Finding(run.path, "", "clock", expected, found, "stopped")


def _frequencies(run: Run, force: str, stretches: Sequence[Stretch]) -> Finding | None:
    """The sines of one sweep against what was commanded."""
    commanded = np.array([one.step.frequency_Hz for one in stretches])
    actual = np.array([_frequency(run, force, one) for one in stretches])
    known = np.isfinite(actual)
    if not known.any():
        return None
    ratios = actual[known] / commanded[known]
    if np.subtract(*np.percentile(np.log(ratios), [75, 25])) > SCATTER:
        return None
    ratio = float(np.median(ratios))
    sweep = stretches[0].step.sweep
    expected = f"sines at the steps' frequencies in sweep {sweep}"
    if abs(ratio - 1) > RATE_ERROR:
        found = f"force at {np.median(actual[known]):.4g} Hz where {np.median(commanded[known]):.4g} Hz are commanded"
        found += factor_text(ratio)
        return Finding(run.path, force, "clock", expected, found, "stopped")
    steps = [b - a for a, b in pairwise(commanded)]
    apart = abs(float(np.median(steps))) if steps else 0.0
    off = float(np.median((actual - commanded)[known]))
    if not apart or abs(abs(off) - apart) > ONE_STEP * apart:
        return None
    clock = abs(ratio - 1) < CLOCK_ERROR
    found = f"force {off:+.3g} Hz off, which is one step" + (", or a clock off by that" if clock else "")
    return Finding(run.path, force, "step", expected, found, "told" if clock else "stopped")


def _frequency(run: Run, channel: str, stretch: Stretch) -> float:
    """The strongest sine in a stretch, Hz: the spectrum's peak, then how fast it turns from one half to the other."""
    device = run.device_of(channel)
    first, last = device.position_at(stretch.start_ns), device.position_at(stretch.stop_ns)
    samples = device.values[channel][first:last].astype(float)
    if len(samples) < LEAST_SAMPLES or not np.isfinite(samples).all() or np.ptp(samples) == 0:
        return np.nan
    rate, half = device.sample_rate_Hz, len(samples) // 2
    spectrum = np.abs(np.fft.rfft(np.hanning(len(samples)) * (samples - samples.mean()), 4 * len(samples)))
    peak_Hz = float(np.argmax(spectrum)) * rate / (4 * len(samples))
    if peak_Hz * half / rate < 2:
        return peak_Hz
    one, two = (line_of(part, peak_Hz / rate) for part in (samples[:half], samples[half : 2 * half]))
    if one == 0:
        return np.nan
    turn = np.angle(two / one * np.exp(-2j * np.pi * peak_Hz / rate * half))
    return float(peak_Hz + turn * rate / (2 * np.pi * half))
