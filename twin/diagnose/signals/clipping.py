"""Flat tops: many samples on one and the same largest value."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from recordings.run import Run
from twin.diagnose.signals.finding import Finding

__all__ = ["find_clipping"]

LEAST_COUNT = 12


def find_clipping(runs: Sequence[Run]) -> list[Finding]:
    """Channels whose largest magnitude is taken by many samples, some of them in a row."""
    findings = []
    for channel in runs[0].channels:
        limits, spoilt = [], {}
        for run in runs:
            if channel not in run.channels:
                continue
            x = run.device_of(channel).values[channel]
            top = float(np.nanmax(np.abs(x), initial=0.0))
            at_top = np.abs(x) >= top * (1 - 1e-5)
            in_a_row = int(np.sum(at_top[1:] & at_top[:-1]))
            if top > 0 and at_top.sum() >= LEAST_COUNT and in_a_row >= LEAST_COUNT / 3:
                limits.append(top)
                spoilt[run.path] = np.flatnonzero(at_top)
        if limits:
            findings.append(
                Finding(
                    cause="clipping",
                    summary=f"{channel} never exceeds {min(limits):.4g}: its peaks are cut off",
                    values={"limit": min(limits)},
                    std={"limit": 1e-3 * min(limits)},
                    names={"channel": channel},
                    spoilt=spoilt,
                )
            )
    return findings
