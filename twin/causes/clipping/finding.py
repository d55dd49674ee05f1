"""Flat tops: peaks that are cut off at one level, by the converter or by an amplifier before it."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Run
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step
from twin.diagnose.signals.limits import LIMITS


def find_clipping(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose peaks are flat."""
    findings = []
    for channel in runs[0].channels:
        limits, signals, within = [], {}, LIMITS.clipping_equal
        for run in runs:
            if channel not in run.channels:
                continue
            x = signals[run.path] = np.nan_to_num(run.device_of(channel).values[channel].astype(float))
            positions = _equal_tops(x)
            if not len(positions):
                positions, within = np.union1d(_flat_tops(x), _flat_tops(-x)), LIMITS.clipping_top
                positions = positions if _outlasts_a_step(run, channel, positions) else positions[:0]
            if len(positions):
                limits.append(float(np.median(np.abs(x[positions]))))
        if limits:
            limit = min(limits)
            limited = {
                path: x for path, x in signals.items() if np.max(np.abs(x)) < LIMITS.clipping_most_over_limit * limit
            }
            cut = {path: _cut(x, (1 - within) * limit) for path, x in limited.items()}
            findings.append(
                Finding(
                    cause="clipping",
                    summary=f"{channel} never exceeds {limit:.4g}: its peaks are cut off",
                    values={"limit": limit},
                    std={"limit": 1e-3 * limit},
                    names={"channel": channel},
                    spoilt={path: positions for path, positions in cut.items() if len(positions)},
                )
            )
    return findings


def _outlasts_a_step(run: Run, channel: str, positions: NDArray[Any]) -> bool:
    """Whether flat tops lie in steps of more than one drive, as a limit's do; or in noise, or in a single long dwell.

    Harmonics may flatten the peaks of one dwell, all alike and each at one height, but hardly those of two.
    """
    device, begun = run.device_of(channel), [step for step in run.steps if np.isfinite(step.frequency_Hz)]
    drives = [(step.frequency_Hz, step.target_amplitude) for step in begun]
    if len(set(drives)) < LIMITS.clipping_several:
        return True
    last = np.searchsorted([device.position_at(step.time_ns) for step in begun], positions, side="right") - 1
    where = {drives[max(int(n), 0)] for n in np.unique(last)}
    return len(where) > 1 or any(frequency == 0 for frequency, _ in where)


def _cut(x: NDArray[Any], level: float) -> NDArray[Any]:
    """Positions of samples from a level on, and beside them: it also cuts peaks that are too narrow to be judged."""
    positions = np.flatnonzero(np.abs(x) >= level)
    beside = (positions[:, None] + np.arange(-LIMITS.clipping_ringing, LIMITS.clipping_ringing + 1)).ravel()
    return np.unique(beside[(beside >= 0) & (beside < len(x))])


def _equal_tops(x: NDArray[Any]) -> NDArray[Any]:
    """Positions of samples on exactly the largest magnitude, of a converter that is fine enough for that to tell."""
    size = np.abs(x)
    top = float(np.max(size, initial=0.0))
    at_top = size >= top * (1 - LIMITS.clipping_equal)
    in_a_row = int(np.sum(at_top[1:] & at_top[:-1]))
    many = at_top.sum() >= LIMITS.clipping_least_count and in_a_row >= LIMITS.clipping_least_count / 3
    if top == 0.0 or not many or smallest_step(x) > 1e-5 * top:
        return np.empty(0, int)
    return np.flatnonzero(at_top)


def _flat_tops(x: NDArray[Any]) -> NDArray[Any]:
    """Positions of samples on flat positive peaks that may carry noise."""
    top = float(np.max(x, initial=0.0))
    if top <= 0:
        return np.empty(0, int)
    usual = float(np.median(x[x >= LIMITS.clipping_high * top]))
    if smallest_step(x) > LIMITS.clipping_top * usual:
        return np.empty(0, int)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], (x >= LIMITS.clipping_shoulder * usual).astype(np.int8), [0]])))
    on_limit = (x >= (1 - LIMITS.clipping_top) * usual) & (x <= (1 + LIMITS.clipping_far) * usual)
    high = np.concatenate([[0], np.cumsum(on_limit)])
    flat, above, below = [], 0, 0
    for start, stop in zip(edges[::2], edges[1::2], strict=True):
        width = stop - start
        if width >= LIMITS.clipping_least_width and high[stop] - high[start] > LIMITS.clipping_flat * width:
            flat.append(start + np.flatnonzero(on_limit[start:stop]))
            off = x[start:stop] / usual - 1
            above += int(np.sum((off > LIMITS.clipping_top) & (off < LIMITS.clipping_far)))
            below += int(np.sum((off < -LIMITS.clipping_top) & (off > -LIMITS.clipping_far)))
    # Noise lies on either side of a limit; harmonics that meet a resonance make tops that rise to one side.
    humped = above - below > LIMITS.clipping_least_count_deviations * np.sqrt(above + below)
    if len(flat) < LIMITS.clipping_least_tops or humped:
        return np.empty(0, int)
    # A third harmonic flattens peaks as well, but each at its own height.
    apart = float(np.std([np.mean(x[top]) for top in flat]))
    by_noise = float(np.median([np.std(x[top]) / np.sqrt(len(top)) for top in flat]))
    cut = apart < max(LIMITS.clipping_level * usual, 2 * by_noise) and by_noise < LIMITS.clipping_shaped * apart
    return np.concatenate(flat) if cut else np.empty(0, int)
