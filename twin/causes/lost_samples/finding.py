"""Stretches in which a channel repeats its last value, and samples that were never received."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Run
from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.levels import smallest_step

LEAST_LENGTH, LEAST_STEPS = 6, 60.0
"""A hold is that many equal samples, of a channel whose rms is that many of its smallest steps."""
FEWEST, CERTAIN = 3, 12
"""Holds that are no chance, or samples of a single one."""
LEAST_JUMP = 5.0
"""Smallest steps by which a channel that stood still is off when it goes on; a slow one goes on by one or two."""
LIMIT = 0.99
"""Share of the largest value from which standing still is a matter of clipping."""


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
    if least == 0.0 or not np.std(sound) > LEAST_STEPS * least:
        return np.empty(0, int)
    equal = np.concatenate([[False], x[1:] == x[:-1]])
    edges = np.flatnonzero(np.diff(np.concatenate([[0], equal.astype(np.int8), [0]])))
    starts, stops = edges[::2], edges[1::2]
    after = np.append(x, np.nan)[stops]
    goes_on = ~(np.abs(after - x[stops - 1]) < LEAST_JUMP * least)
    within = np.abs(x[stops - 1]) < LIMIT * np.max(np.abs(sound))
    long = (stops - starts >= LEAST_LENGTH - 1) & goes_on & within
    if long.sum() < FEWEST and not np.any((stops - starts)[long] >= CERTAIN):
        return np.empty(0, int)
    return np.concatenate([np.arange(a, b) for a, b in zip(starts[long], stops[long], strict=True)])
