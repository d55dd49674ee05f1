"""Whether samples and time stamps go together, and the sines that a run's force makes are those of its steps."""

from collections.abc import Sequence

import numpy as np

from recordings.run import DeviceSamples, Run
from recordings.sweeps import Stretch, measured_stretches, sweeps
from twin.arrays import Array
from twin.checks.finding import Finding
from twin.checks.responses import LEAST_SAMPLES, line_of, whole_stretch
from twin.checks.thresholds import CLEARER, CLOCK_ERROR, CRYSTAL, LEAST_STEPS, NOT_A_SINE, ONE_STEP, RATE_ERROR, TORN
from twin.checks.units import factor_text

PARTS, LEAST_TURNS = 4, 2
"""Of a stretch that are held against each other, and the periods that each of them needs."""


def look_at_clock(run: Run, *, force: str) -> list[Finding]:
    """One finding at most: whatever the clock is wrong by shows in all that follows."""
    for device in run.devices.values():
        finding = _rate(run, device)
        if finding is not None:
            return [finding]
    measured = measured_stretches(run)
    device = run.device_of(force)
    counts = [device.position_at(one.stop_ns) - device.position_at(one.start_ns) for one in measured]
    if measured and sum(count < LEAST_SAMPLES for count in counts) > len(measured) / 2:
        first, last = measured[0].start_ns * 1e-9, measured[-1].start_ns * 1e-9
        begun, ended = int(device.block_time_ns[0]) * 1e-9, device.end_ns * 1e-9
        expected = f"steps within the samples' time, which is {begun:.4g} to {ended:.4g} s"
        found = f"steps from {first:.4g} to {last:.4g} s, most of them without samples"
        return [Finding(run.path, "", "clock", expected, found, "stopped")]
    return _look_at_sines(run, force)


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


def _look_at_sines(run: Run, force: str) -> list[Finding]:
    """One finding at most, of the first sweep that has one; else how many have hardly any steps."""
    swept = [one for sweep in sweeps(run) if (one := [s for s in sweep.stretches if s.step.frequency_Hz])]
    findings = [finding for stretches in swept if (finding := _look(run, force, stretches))][:1]
    few = [one for one in swept if len({s.step.frequency_Hz for s in one}) < LEAST_STEPS]
    if few and not findings:
        found = f"sweep {few[0][0].step.sweep} has {len(few[0])}" + (f", and {len(few) - 1} more" if few[1:] else "")
        expected = f"sweeps of at least {LEAST_STEPS} steps about a resonance"
        return [Finding(run.path, "", "few", expected, found, "told")]
    return findings


def _look(run: Run, force: str, stretches: Sequence[Stretch]) -> Finding | None:
    commanded = np.array([one.step.frequency_Hz for one in stretches])
    actual, torn = np.array([_sine(run, force, one) for one in stretches]).T
    known = np.isfinite(actual)
    if not known.any():
        return None
    expected = f"sines at the steps' frequencies in sweep {stretches[0].step.sweep}"
    fine = np.isfinite(torn)
    if fine.any() and np.median(torn[fine]) > TORN:
        found = "force changes its sine within the steps: their log is late or early, or they were not awaited"
        return Finding(run.path, force, "step", expected, found, "stopped")
    other = _of_other_steps(commanded[known], actual[known], commanded)
    if other is not None:
        found, clock = other
        found += ", or a clock off by that" if clock else ""
        return Finding(run.path, force, "step", expected, found, "told" if clock else "stopped")
    ratio = float(np.median(actual[known] / commanded[known]))
    if abs(ratio - 1) < RATE_ERROR:
        return _of_clock(run.path, force, actual[fine] / commanded[fine] - 1, expected)
    found = f"force at {np.median(actual[known]):.4g} Hz where {np.median(commanded[known]):.4g} Hz are commanded"
    return Finding(run.path, force, "clock", expected, found + factor_text(ratio), "stopped")


def _of_clock(run: str, force: str, off: Array, expected: str) -> Finding | None:
    """Whether all steps (s,) that tell it closely are off by the same share, and by more than a crystal's."""
    if not len(off) or abs(np.median(off)) < max(CRYSTAL, CLEARER * float(np.median(np.abs(off - np.median(off))))):
        return None
    found = f"force {1e6 * np.median(off):+.0f} ppm off in all of them: a clock of generator or converter"
    return Finding(run, force, "clock", expected, found, "told")


def _of_other_steps(commanded: Array, actual: Array, every: Array) -> tuple[str, bool] | None:
    """How the sines (s,) are those of other steps than their own, and whether a wrong clock may be what makes them so.

    Parameters
    ----------
    every
        Frequencies of all steps of the sweep.
    """
    distances = np.abs(np.diff(every))
    if not distances.any():
        return None
    apart = float(np.median(distances[distances > 0]))
    off = actual - commanded
    ratio, shift = np.median(off / commanded), float(np.median(off))
    by_clock, by_shift = (float(np.median(np.abs(off - one))) for one in (ratio * commanded, shift))
    by_order = float(np.median(np.min(np.abs(actual[:, None] - every), axis=1)))
    if np.median(np.abs(off)) < ONE_STEP * apart:
        return None
    if abs(abs(shift) - apart) < ONE_STEP * apart:
        found, left = f"force {shift:+.3g} Hz off, which is one step", min(by_shift, by_order)
    elif by_order < ONE_STEP * apart:
        found, left = "force has the sines of the steps in another order", by_order
    else:
        return None
    clock = by_clock < CLEARER * left
    return None if clock and abs(ratio) > CLOCK_ERROR else (found, bool(clock))


def _sine(run: Run, channel: str, stretch: Stretch) -> tuple[float, float]:
    """The strongest sine in a stretch: its frequency, Hz, and the share of its power that its parts have not in common.

    The spectrum's peak, then how fast it turns from one half to the other; nan where there is no sine, and a share of
    nan where it has so few periods that the peak must do.
    """
    samples, rate = whole_stretch(run, channel, stretch), run.device_of(channel).sample_rate_Hz
    if samples is None or np.ptp(samples) == 0:
        return np.nan, np.nan
    spectrum = np.abs(np.fft.rfft(np.hanning(len(samples)) * (samples - samples.mean()), 4 * len(samples)))
    turns = float(np.argmax(spectrum)) / (4 * len(samples))
    parts = PARTS if turns * len(samples) >= PARTS * LEAST_TURNS else 1
    if parts > 1:
        one, two = _lines(samples, turns, 2)
        turns += float(np.angle(two * np.conj(one))) / (2 * np.pi * (len(samples) // 2))
    lines = _lines(samples, turns, parts)
    power = float(np.mean(np.abs(lines) ** 2))
    if power / 2 < NOT_A_SINE * np.var(samples):
        return np.nan, np.nan
    return turns * rate, 1 - float(np.abs(np.mean(lines)) ** 2) / power if parts > 1 else np.nan


def _lines(samples: Array, turns: float, parts: int) -> Array:
    """Complex amplitudes of the sine in parts (p,) of equal length, all from one beginning."""
    length = len(samples) // parts
    lines = np.array([line_of(samples[k * length : (k + 1) * length], turns) for k in range(parts)])
    return np.asarray(lines * np.exp(-2j * np.pi * turns * length * np.arange(parts)))
