"""Dwells too short: the response still changes while it is measured."""

from collections.abc import Sequence

from twin.diagnose.signals.finding import Finding
from twin.diagnose.signals.limits import LIMITS
from twin.identify.spectra.settled import still_changing
from twin.identify.spectra.sine_fit import SteadyState
from twin.identify.spectra.sweeps import rows_by_sweep


def find_unsettled(states: Sequence[SteadyState], *, force: str) -> list[Finding]:
    """Sweeps in which many steps still change within their measurement."""
    findings = []
    channels = sorted({channel for state in states for channel in state.drift} - {force})
    changing = still_changing(states, channels, force=force)
    for sweep, rows in rows_by_sweep(states).items():
        count = sum(changing[i] for i in rows)
        if len(rows) >= LIMITS.unsettled_least_steps and count > LIMITS.least_share * len(rows):
            findings.append(
                Finding(
                    cause="unsettled-dwell",
                    summary=f"in sweep {sweep}, {count} of {len(rows)} steps were measured before they settled",
                    names={"sweep": sweep},
                )
            )
    return findings
