"""Jump ahead: between two steps the response leaves one branch for another."""

from __future__ import annotations

from twin.procedures import SteppedSine
from twin.rehearsal.checks.coarse_grid import ALLOWED_DEGREES, phase_steps, steepest_linear
from twin.rehearsal.rehearsal import Caution, Rehearsal

__all__ = ["check_jumps"]


def check_jumps(rehearsal: Rehearsal) -> list[Caution]:
    """Find steps over which the phase turns farther than any linear resonance of the believed width can.

    A procedure that sweeps both ways records both branches: there a jump is worth a note only.
    """
    procedure = rehearsal.procedure
    if not isinstance(procedure, SteppedSine):
        return []
    found = []
    both = procedure.direction == "both"
    for sweep, steps in rehearsal.sweeps().items():
        turns = phase_steps(rehearsal, steps)
        jumps = [i for i, turn in enumerate(turns) if turn > max(ALLOWED_DEGREES, steepest_linear(rehearsal, steps, i))]
        if not jumps:
            continue
        worst = max(jumps, key=lambda i: turns[i])
        here, there = steps[worst], steps[worst + 1]
        channel = rehearsal.response_channel(steps) or ""
        ratio = abs(there.phasors.get(channel, 0j)) / max(abs(here.phasors.get(channel, 0j)), 1e-300)
        found.append(
            Caution(
                kind="jump-ahead", severity="note" if both else "warning", sweep=sweep, index=there.index,
                frequency_Hz=there.frequency_Hz, steps=len(jumps),
                reason=f"the response jumps between {here.frequency_Hz:g} and {there.frequency_Hz:g} Hz: "
                f"{ratio:.2g} times the amplitude, {turns[worst]:.0f} degrees of phase",
                advice="both branches are recorded; mind the limits at the jump"
                if both
                else "sweep both ways, so that both branches are recorded; or hold the response, which has no jump",
                changes={} if both else {"direction": "both"},
            )
        )  # fmt: skip
    return found
