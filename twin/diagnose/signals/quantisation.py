"""A converter with fewer bits than it should have: all values are multiples of a coarse step."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from recordings.run import Run
from twin.diagnose.signals.finding import Finding

__all__ = ["find_quantisation"]

COARSEST = 3.0 / 2**15
"""Share of the range that a step may have: somewhat more than a 16-bit converter's."""


def find_quantisation(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose smallest step is coarser than a 16-bit converter's."""
    findings = []
    for channel, what in runs[0].channels.items():
        steps = []
        for run in runs:
            if channel in run.channels:
                x = run.device_of(channel).values[channel]
                steps.append(_smallest_step(x[np.isfinite(x)][:200_000].astype(float)))
        step = min(steps, default=0.0)
        if what.range and step > COARSEST * what.range:
            findings.append(
                Finding(
                    cause="quantisation",
                    summary=f"{channel} moves in steps of {step:.3g} {what.unit}",
                    values={"step": step},
                    std={"step": 0.01 * step},
                    names={"channel": channel},
                )
            )
    return findings


def _smallest_step(x: np.ndarray) -> float:
    """The step that almost all differences between neighbouring levels are; 0 for a channel that never moves."""
    levels = np.unique(x)
    if len(levels) < 3:
        return 0.0
    return float(np.quantile(np.diff(levels), 0.05))
