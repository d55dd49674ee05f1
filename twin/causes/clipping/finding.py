"""Flat tops: peaks that are cut off at one level, by the converter or by an amplifier before it."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import PIECE, Run, Samples, pieces
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step
from twin.diagnose.signals.limits import LIMITS


def find_clipping(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose peaks are flat."""
    findings = []
    for channel in runs[0].channels:
        limits: list[float] = []
        signals: dict[str, _Known] = {}
        within = LIMITS.clipping_equal
        for run in runs:
            if channel not in run.channels:
                continue
            x = signals[run.path] = _Known(run.device_of(channel).values[channel])
            positions = _equal_tops(x)
            if not len(positions):
                positions, within = np.union1d(_flat_tops(x), _flat_tops(-x)), LIMITS.clipping_top
                positions = positions if _outlasts_a_step(run, channel, positions) else positions[:0]
            if len(positions):
                limits.append(float(np.median(np.abs(_at(x, positions)))))
        if limits:
            limit = min(limits)
            limited = {path: x for path, x in signals.items() if x.largest < LIMITS.clipping_most_over_limit * limit}
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


class _Known:
    """A channel's samples as float64, with zeros where some were lost."""

    def __init__(self, samples: Samples) -> None:
        self._samples = samples

    def __len__(self) -> int:
        return len(self._samples)

    def __getitem__(self, key: slice) -> NDArray[np.float64]:
        return np.nan_to_num(self._samples[key].astype(float))

    def __array__(self) -> NDArray[np.float64]:
        return self[:]

    def __neg__(self) -> _Known:
        turned = _Known(-self._samples)
        turned.ends = -self.ends[1], -self.ends[0]
        return turned

    @cached_property
    def ends(self) -> tuple[float, float]:
        """The least and the greatest, but zero at most and at least."""
        ends = [(np.min(piece), np.max(piece)) for piece in pieces(self)]
        return float(np.min(ends, initial=0.0)), float(np.max(ends, initial=0.0))

    @property
    def largest(self) -> float:
        """Size of any."""
        return max(-self.ends[0], self.ends[1])


def _where(x: Samples, holds: Callable[[NDArray[Any]], NDArray[Any]]) -> NDArray[Any]:
    """Positions of samples for which something holds."""
    starts = range(0, len(x), PIECE)
    found = [at + np.flatnonzero(holds(piece)) for at, piece in zip(starts, pieces(x), strict=True)]
    return np.concatenate([np.empty(0, int), *found])


def _at(x: Samples, positions: NDArray[Any]) -> NDArray[Any]:
    """Samples at positions in rising order."""
    ends = np.searchsorted(positions, np.arange(0, len(x) + PIECE, PIECE))
    each = zip(range(0, len(x), PIECE), ends[:-1], ends[1:], strict=True)
    found = [x[at : at + PIECE][positions[a:b] - at] for at, a, b in each if a < b]
    return np.concatenate([np.empty(0), *found])


def _cut(x: _Known, level: float) -> NDArray[Any]:
    """Positions of samples from a level on, and beside them: it also cuts peaks that are too narrow to be judged."""
    positions = _where(x, lambda piece: np.abs(piece) >= level)
    beside = (positions[:, None] + np.arange(-LIMITS.clipping_ringing, LIMITS.clipping_ringing + 1)).ravel()
    return np.unique(beside[(beside >= 0) & (beside < len(x))])


def _equal_tops(x: _Known) -> NDArray[Any]:
    """Positions of samples on exactly the largest magnitude, of a converter that is fine enough for that to tell."""
    top = x.largest
    if top == 0.0:
        return np.empty(0, int)
    at_top = _where(x, lambda piece: np.abs(piece) >= top * (1 - LIMITS.clipping_equal))
    in_a_row = int(np.sum(np.diff(at_top) == 1))
    many = len(at_top) >= LIMITS.clipping_least_count and in_a_row >= LIMITS.clipping_least_count / 3
    return np.empty(0, int) if not many or smallest_step(x) > 1e-5 * top else at_top


def _flat_tops(x: _Known) -> NDArray[Any]:
    """Positions of samples on flat positive peaks that may carry noise."""
    top = x.ends[1]
    if top <= 0:
        return np.empty(0, int)
    high = [piece[piece >= LIMITS.clipping_high * top].astype(np.float32) for piece in pieces(x)]
    usual = float(np.median(np.concatenate(high), overwrite_input=True))  # there may be many
    if smallest_step(x) > LIMITS.clipping_top * usual:
        return np.empty(0, int)
    tops = _Tops()
    for at, window in _windows(x, LIMITS.clipping_shoulder * usual):
        tops.take(at, window, usual)
    # Noise lies on either side of a limit; harmonics that meet a resonance make tops that rise to one side.
    humped = tops.above - tops.below > LIMITS.clipping_least_count_deviations * np.sqrt(tops.above + tops.below)
    if len(tops.flat) < LIMITS.clipping_least_tops or humped:
        return np.empty(0, int)
    # A third harmonic flattens peaks as well, but each at its own height.
    apart = float(np.std(tops.means))
    by_noise = float(np.median(tops.errors))
    cut = apart < max(LIMITS.clipping_level * usual, 2 * by_noise) and by_noise < LIMITS.clipping_shaped * apart
    return np.concatenate(tops.flat) if cut else np.empty(0, int)


@dataclass
class _Tops:
    """Flat tops found so far: positions, means and their errors, and samples off the limit on either side."""

    flat: list[NDArray[Any]] = field(default_factory=list)
    means: list[float] = field(default_factory=list)
    errors: list[float] = field(default_factory=list)
    above: int = 0
    below: int = 0

    def take(self, at: int, x: NDArray[Any], usual: float) -> None:
        """Those in a window that begins at a position and cuts none of them."""
        shoulders = (x >= LIMITS.clipping_shoulder * usual).astype(np.int8)
        edges = np.flatnonzero(np.diff(np.concatenate([[0], shoulders, [0]])))
        on_limit = (x >= (1 - LIMITS.clipping_top) * usual) & (x <= (1 + LIMITS.clipping_far) * usual)
        high = np.concatenate([[0], np.cumsum(on_limit)])
        for start, stop in zip(edges[::2], edges[1::2], strict=True):
            width = stop - start
            if width >= LIMITS.clipping_least_width and high[stop] - high[start] > LIMITS.clipping_flat * width:
                flat = start + np.flatnonzero(on_limit[start:stop])
                self.flat.append(at + flat)
                self.means.append(float(np.mean(x[flat])))
                self.errors.append(float(np.std(x[flat]) / np.sqrt(len(flat))))
                off = x[start:stop] / usual - 1
                self.above += int(np.sum((off > LIMITS.clipping_top) & (off < LIMITS.clipping_far)))
                self.below += int(np.sum((off < -LIMITS.clipping_top) & (off > -LIMITS.clipping_far)))


def _windows(x: _Known, level: float) -> Iterator[tuple[int, NDArray[Any]]]:
    """Consecutive pieces with their positions, moved to end below a level where it is not passed for a whole piece."""
    carried: list[NDArray[Any]] = []
    at = 0
    for piece in pieces(x):
        below = np.flatnonzero(piece < level)
        if not len(below):
            carried.append(piece)
            continue
        end = int(below[-1]) + 1
        window = np.concatenate([*carried, piece[:end]])
        yield at, window
        at, carried = at + len(window), [piece[end:]]
    yield at, np.concatenate([*carried, np.empty(0)])
