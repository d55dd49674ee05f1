"""Dwells too short: the response still changes while it is measured."""

from __future__ import annotations

from collections.abc import Sequence

from twin.diagnose.signals.finding import Finding
from twin.identify.sine_fit import SteadyState
from twin.identify.sweeps import rows_by_sweep

__all__ = ["find_unsettled"]

LEAST_SHARE = 0.25
"""Share of a sweep's steps; a jump alone leaves only a few."""
LEAST_CHANGE, LEAST_SIGMA = 3e-3, 6.0


def find_unsettled(states: Sequence[SteadyState], *, force: str) -> list[Finding]:
    """Sweeps in which many steps still change by more than a few thousandths within their measurement."""
    findings = []
    for sweep, rows in rows_by_sweep(states).items():
        own = [states[i] for i in rows]
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
