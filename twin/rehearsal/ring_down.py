"""Damping ratio and frequency of a recorded free decay: the logarithmic decrement, over the amplitude."""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from recordings import read_run
from recordings.run import Run, Step, StepState
from twin.arrays import Array
from twin.procedures import ProcedureResult, StepResult
from twin.rehearsal.limits import LIMITS


@dataclass(frozen=True, kw_only=True)
class DecayPart:
    """A stretch of a decay: its middle amplitude (SI units), and what it decays with there."""

    amplitude: float
    frequency_Hz: float
    damping_ratio: float
    damping_ratio_std: float


@dataclass(frozen=True, kw_only=True)
class Decay:
    """A free decay of one channel, the shaker attached and its generator at zero.

    `parts` are stretches of equal decrease, from the largest amplitude down; `depends` says whether the damping ratio
    changes along them by more than three of its standard deviations and by more than 2 %.
    """

    sweep: str
    index: int
    channel: str
    amplitude: float
    frequency_Hz: float
    damping_ratio: float
    parts: tuple[DecayPart, ...]
    depends: bool


def free_decays(result: ProcedureResult, recording: Path, channels: list[str]) -> Iterator[Decay]:
    """Each decay of a ring-down procedure that was recorded whole, by the response of `channels` that is largest."""
    decays = {(step.sweep, step.index): step for step in result.steps if not step.target_amplitude}
    if not decays or not channels:
        return
    run = read_run(recording)
    for mark in run.steps:
        step = decays.get((mark.sweep, mark.index))
        if step is not None and mark.state == StepState.MEASURING:
            decay = _decay(run, mark, step, channels)
            if decay is not None:
                yield decay


def _decay(run: Run, mark: Step, step: StepResult, channels: list[str]) -> Decay | None:
    stop_ns = mark.time_ns + round(step.measure_s * 1e9)
    samples = {name: run.between(name, mark.time_ns, stop_ns).astype(float) for name in channels}
    name = max(samples, key=lambda one: float(np.nanmax(np.abs(samples[one]), initial=0.0)))
    times = run.device_of(name).times_ns()
    sample_rate_Hz = 1e9 * (len(times) - 1) / float(times[-1] - times[0])
    t, z = _phasors(samples[name], sample_rate_Hz, mark.frequency_Hz)
    if len(t) < 2 * LIMITS.fewest_windows:
        return None
    size = np.abs(z)
    # what is left when all has decayed is noise; a decay cut off before that has none to judge by
    noise = float(np.median(size[-max(len(size) // 10, 1) :])) if size[-1] < 0.01 * size[0] else 0.0
    followed = int(np.argmax(np.append(size, 0.0) < LIMITS.least_above_noise * noise)) if noise else len(t)
    if followed < 2 * LIMITS.fewest_windows:
        return None
    t, logarithm = t[:followed], np.log(size[:followed]) + 1j * np.unwrap(np.angle(z[:followed]))
    whole = _fitted(t, logarithm, mark.frequency_Hz)
    count = min(5, followed // LIMITS.fewest_windows)
    parts = tuple(_fitted(t[i], logarithm[i], mark.frequency_Hz) for i in np.array_split(np.arange(followed), count))
    first, last = parts[0], parts[-1]
    change = abs(first.damping_ratio - last.damping_ratio)
    scatter = math.hypot(first.damping_ratio_std, last.damping_ratio_std)
    return Decay(
        sweep=step.sweep, index=step.index, channel=name, amplitude=float(size[0]), frequency_Hz=whole.frequency_Hz,
        damping_ratio=whole.damping_ratio, parts=parts,
        depends=change > 3 * scatter and change > 0.02 * whole.damping_ratio,
    )  # fmt: skip


def _phasors(samples: Array, sample_rate_Hz: float, frequency_Hz: float) -> tuple[Array, Array]:
    """Times and complex amplitudes of neighbouring Hann windows of ten cycles; none where a sample was lost."""
    length = max(round(10 / frequency_Hz * sample_rate_Hz), 8)
    count = len(samples) // length
    t = np.arange(count * length).reshape(count, length) / sample_rate_Hz
    weights = np.hanning(length + 1)[:-1]
    turned = samples[: count * length].reshape(count, length) * np.exp(-2j * np.pi * frequency_Hz * t)
    z = 2 * (turned @ weights) / weights.sum()
    known = np.isfinite(z) & (np.abs(z) > 0)
    return t.mean(axis=1)[known], z[known]


def _fitted(t: Array, logarithm: Array, frequency_Hz: float) -> DecayPart:
    """Least squares: the slope of the logarithm is -zeta w0 + i (wd - w), with w that of the demodulation."""
    centred = t - t.mean()
    slope = complex(centred @ logarithm / (centred @ centred))
    left = logarithm - logarithm.mean() - slope * centred
    spread = math.sqrt(float(np.sum(left.real**2)) / max(len(t) - 2, 1) / float(centred @ centred))
    damped = 2 * math.pi * frequency_Hz + slope.imag
    natural = math.hypot(damped, slope.real)
    return DecayPart(
        amplitude=float(np.exp(logarithm.real.mean())),
        frequency_Hz=damped / (2 * math.pi),
        damping_ratio=-slope.real / natural,
        damping_ratio_std=spread / natural,
    )
