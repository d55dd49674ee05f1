"""Levels that are off by the factor of a unit."""

from __future__ import annotations

import math
from collections.abc import Container, Sequence

import numpy as np

from twin.checks.agreement import Agreement
from twin.checks.finding import Finding
from twin.checks.thresholds import ALIKE, GAIN, SHAPE
from twin.checks.units import OF_FORCE, OF_RESPONSE, POUND_FORCE_N, name_of

__all__ = ["look_at_scale"]


def look_at_scale(
    run: str,
    agreement: Agreement,
    channels: Sequence[str],
    *,
    force: str,
    commanded: float,
    known: Container[str] = (),
) -> list[Finding]:
    """What the levels say of a run's units.

    Parameters
    ----------
    channels
        Those of `agreement`.
    commanded
        Force over what the steps command; nan if they do not say.
    known
        Channels of which the rig file says something already.
    """
    findings = []
    level = agreement.level
    if _off(commanded) and (name := name_of(commanded, OF_FORCE)):
        findings.append(_finding(run, force, commanded, "the steps command", name, stop=True))
        level = level * commanded
    sure = bool(np.all(agreement.shape < SHAPE))
    logs = np.log(level)
    if not findings and len(level) > 1 and np.ptp(logs) < ALIKE and _off(float(level[0])):
        return [_of_all(run, float(np.exp(np.mean(logs))), force, channels, stop=sure)]
    for channel, factor in zip(channels, level.tolist(), strict=True):
        if _off(factor) and channel not in known:
            name = name_of(factor, OF_RESPONSE)
            findings.append(_finding(run, channel, factor, "the rig's model", name, stop=sure and bool(name)))
    return findings


def _off(factor: float) -> bool:
    return math.isfinite(factor) and factor > 0 and abs(math.log(factor)) > math.log(GAIN)


def _of_all(run: str, factor: float, force: str, channels: Sequence[str], *, stop: bool) -> Finding:
    """All responses are off alike: they, or the force, or both."""
    both = factor * 9.80665 / POUND_FORCE_N
    names = {
        ", ".join(channels): name_of(factor, OF_RESPONSE),
        force: name_of(1 / factor, OF_FORCE),
        "": "force in lbf and responses in g?" if abs(math.log(both)) < ALIKE / 2 else "",
    }
    order = ["", *list(names)[:2]] if names[""] else list(names)[:2]
    channel = next((one for one in order if names[one]), force)
    told = 1 / factor if channel == force else factor
    return _finding(run, channel, told, "the rig's model", names[channel], stop=stop and bool(names[channel]))


def _finding(run: str, channel: str, factor: float, says: str, name: str, *, stop: bool) -> Finding:
    found = f"{factor:.3g} times that" + (f", {name}" if name else ", which is no unit's factor")
    what = "the response per force" if says == "the rig's model" else "the force"
    return Finding(run, channel, "unit", f"{what} that {says} has", found, "stopped" if stop else "told")
