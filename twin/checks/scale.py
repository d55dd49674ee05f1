"""Levels that are off by the factor of a unit."""

import math
from collections.abc import Container, Sequence

import numpy as np
from scipy.constants import pound_force

from recordings.quantities import STANDARD_GRAVITY
from twin.checks.agreement import Agreement
from twin.checks.finding import Finding
from twin.checks.thresholds import ABSURD, ALIKE, CLEARER, GAIN, SHAPE
from twin.checks.units import OF_FORCE, OF_RESPONSE, name_of

G_OVER_POUNDS = pound_force / STANDARD_GRAVITY
"""Of the response per force with the one in g and the other in lbf."""
MODEL = "the response per force of the rig's model"


def look_at_scale(
    run: str, agreement: Agreement, channels: Sequence[str], *, force: str, commanded: float, known: Container[str] = ()
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
    findings = look_at_commanded(run, commanded, force=force)
    level = agreement.level * (commanded if findings else 1)
    logs = np.log(level)
    sure = np.all(agreement.shape < SHAPE) & (CLEARER * agreement.shape < np.abs(logs))
    if not findings and len(level) > 1 and np.ptp(logs) < ALIKE and _off(float(level[0])):
        return [_of_all(run, float(np.exp(np.mean(logs))), force, channels, stop=bool(sure.all()))]
    for channel, factor, stop in zip(channels, level.tolist(), sure.tolist(), strict=True):
        if _off(factor) and channel not in known:
            name = name_of(factor, OF_RESPONSE)
            findings.append(_finding(run, channel, factor, MODEL, name, stop=stop))
    return findings


def look_at_commanded(run: str, commanded: float, *, force: str) -> list[Finding]:
    """Whether the force is off what the steps command, by a factor that has a name."""
    name = name_of(commanded, OF_FORCE) if _off(commanded) else ""
    return [_finding(run, force, commanded, "the force that the steps command", name, stop=True)] if name else []


def _off(factor: float) -> bool:
    return math.isfinite(factor) and factor > 0 and abs(math.log(factor)) > math.log(GAIN)


def _of_all(run: str, factor: float, force: str, channels: Sequence[str], *, stop: bool) -> Finding:
    """All responses are off alike: they, or the force, or both."""
    if abs(math.log(factor / G_OVER_POUNDS)) < ALIKE / 2:
        return _finding(run, "", factor, MODEL, f"{force} in lbf and responses in g?", stop=stop)
    responses, of_force = name_of(factor, OF_RESPONSE), name_of(1 / factor, OF_FORCE)
    if of_force and not responses:
        return _finding(run, force, 1 / factor, "the force that the responses tell", of_force, stop=stop)
    name = f"{responses} Or {force}, {of_force}" if responses and of_force else responses
    return _finding(run, ", ".join(channels), factor, MODEL, name, stop=stop)


def _finding(run: str, channel: str, factor: float, whose: str, name: str, *, stop: bool) -> Finding:
    what = name or "which is no unit's factor"
    found = f"{factor:.3g} times {whose}, " + (what if stop else "and not the same over all frequencies")
    stops = stop and (bool(name) or abs(math.log(factor)) > math.log(ABSURD))
    return Finding(run, channel, "unit", "a factor near 1", found, "stopped" if stops else "told")
