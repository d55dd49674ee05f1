"""Dwells too short: the response still changes while it is measured."""

from __future__ import annotations

from collections.abc import Sequence

from twin.diagnose.signals.finding import Finding
from twin.identify.sine_fit import SteadyState

__all__ = ["find_unsettled"]

LEAST_SHARE = 0.25
"""Share of a sweep's steps; a jump alone leaves only a few."""
LEAST_CHANGE, LEAST_SIGMA = 3e-3, 6.0


def find_unsettled(states: Sequence[SteadyState], *, force: str) -> list[Finding]:
    """Sweeps in which many steps still change by more than a few thousandths within their measurement."""
    findings = []
    for sweep in dict.fromkeys(state.sweep for state in states):
        own = [state for state in states if state.sweep == sweep]
        changing = [state for state in own if _changes(state, force)]
        if len(own) >= 8 and len(changing) > LEAST_SHARE * len(own):
            findings.append(
                Finding(
                    cause="unsettled-dwell",
                    summary=f"in sweep {sweep}, {len(changing)} of {len(own)} steps were measured before they settled",
                    names={"sweep": sweep},
                )
            )
    return findings


def _changes(state: SteadyState, force: str) -> bool:
    changes = {channel: abs(state.change(channel, force=force)) for channel in state.drift}
    return any(d > LEAST_CHANGE and d > LEAST_SIGMA * state.drift_std[c] for c, d in changes.items())
