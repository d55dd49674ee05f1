"""Stretches in which a channel repeats its last value, and samples that were never received."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.level import Level
from recordings.run import PIECE, Run, Samples
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step
from twin.diagnose.signals.limits import LIMITS


def find_lost_samples(runs: Sequence[Run]) -> list[Finding]:
    """Channels that stand still while they should not, or whose samples are missing."""
    findings = []
    for channel in runs[0].channels:
        spoilt: dict[str, NDArray[Any]] = {}
        missing = 0
        for run in runs:
            if channel not in run.channels:
                continue
            x = run.device_of(channel).values[channel]
            level = Level.of(x)
            missing += len(x) - level.count
            held = _held(x, level)
            if len(held):
                spoilt[run.path] = held
        count = sum(len(positions) for positions in spoilt.values())
        if count or missing:
            findings.append(
                Finding(
                    cause="lost-samples",
                    summary=f"{channel}: {count} samples only repeat the one before, {missing} are missing",
                    names={"channel": channel},
                    spoilt=spoilt,
                )
            )
    return findings


def _held(x: Samples, level: Level) -> NDArray[Any]:
    """Positions of samples that repeat the one before them in long rows."""
    least = smallest_step(x)
    if least == 0.0 or not level.std > LIMITS.lost_samples_least_steps * least:
        return np.empty(0, int)
    starts, stops = _rows(x)
    last, after = np.array([np.append(x[stop - 1 : stop + 1], np.nan)[:2] for stop in stops]).reshape(-1, 2).T
    goes_on = ~(np.abs(after - last) < LIMITS.lost_samples_least_jump * least)
    within = np.abs(last) < LIMITS.lost_samples_limit * level.largest
    long = goes_on & within
    if long.sum() < LIMITS.lost_samples_fewest and not np.any((stops - starts)[long] >= LIMITS.lost_samples_certain):
        return np.empty(0, int)
    return np.concatenate([np.arange(a, b) for a, b in zip(starts[long], stops[long], strict=True)])


def _rows(x: Samples) -> tuple[NDArray[Any], NDArray[Any]]:
    """Where samples begin and end to repeat the one before them in rows that are long enough to count."""
    starts, stops = [np.empty(0, int)], [np.empty(0, int)]
    open_since: int | None = None
    for at in range(1, len(x), PIECE):
        stop = min(at + PIECE, len(x))
        piece = x[at - 1 : stop]
        equal = piece[1:] == piece[:-1]
        edges = at + np.flatnonzero(np.diff(np.concatenate([[False], equal, [False]]).astype(np.int8)))
        begun, ended = edges[::2], edges[1::2]
        if open_since is not None:
            if equal[0]:
                begun[0] = open_since
            else:
                begun, ended = np.insert(begun, 0, open_since), np.insert(ended, 0, at)
        open_since = int(begun[-1]) if equal[-1] and stop < len(x) else None
        if open_since is not None:
            begun, ended = begun[:-1], ended[:-1]
        long = ended - begun >= LIMITS.lost_samples_least_length - 1
        starts.append(begun[long])
        stops.append(ended[long])
    return np.concatenate(starts), np.concatenate(stops)
