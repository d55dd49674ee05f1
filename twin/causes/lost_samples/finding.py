"""Stretches in which a channel repeats its last value, and samples that were never received."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Run
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
            missing += int(np.sum(~np.isfinite(x)))
            held = _held(x)
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


def _held(x: NDArray[Any]) -> NDArray[Any]:
    """Positions of samples that repeat the one before them in long rows."""
    least = smallest_step(x)
    sound = x[np.isfinite(x)].astype(float)
    if least == 0.0 or not np.std(sound) > LIMITS.lost_samples_least_steps * least:
        return np.empty(0, int)
    equal = np.concatenate([[False], x[1:] == x[:-1]])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(np.int8), [0]])))
    starts, stops = edges[::2], edges[1::2]
    after = np.append(x, np.nan)[stops]
    goes_on = ~(np.abs(after - x[stops - 1]) < LIMITS.lost_samples_least_jump * least)
    within = np.abs(x[stops - 1]) < LIMITS.lost_samples_limit * np.max(np.abs(sound))
    long = (stops - starts >= LIMITS.lost_samples_least_length - 1) & goes_on & within
    if long.sum() < LIMITS.lost_samples_fewest and not np.any((stops - starts)[long] >= LIMITS.lost_samples_certain):
        return np.empty(0, int)
    return np.concatenate([np.arange(a, b) for a, b in zip(starts[long], stops[long], strict=True)])
