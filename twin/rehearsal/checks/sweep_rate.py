"""Swept sine too fast: the resonance has no time to build up; its peak comes out low, wide and late."""

from twin.procedures import SweptSine
from twin.rehearsal.rehearsal import Caution, Rehearsal

FASTEST = 216.0 / 60.0
"""Rate over the square of damping ratio times natural frequency up to which a resonance builds up: ISO 7626-2."""
WANTED = 0.5
"""Of the fastest rate, what is advised: at that rate itself the peak still comes out 5 % low."""


def check_sweep_rate(rehearsal: Rehearsal) -> list[Caution]:
    """Judge each sweep by the resonance that it met."""
    procedure = rehearsal.procedure
    if not isinstance(procedure, SweptSine):
        return []
    found = []
    for step in rehearsal.result.steps:
        if step.peak_frequency_Hz is None:
            continue
        half_Hz = rehearsal.half_width_Hz(step.peak_frequency_Hz)
        fastest = FASTEST * half_Hz**2
        if procedure.rate <= fastest:
            continue
        rate = float(f"{WANTED * fastest:.2g}")
        found.append(
            Caution(
                kind="sweep-too-fast", severity="warning", sweep=step.sweep, index=step.index,
                frequency_Hz=step.peak_frequency_Hz, steps=1,
                reason=f"{procedure.rate:g} Hz/s passes the resonance near {step.peak_frequency_Hz:.4g} Hz, which is "
                f"{2 * half_Hz:.2g} Hz wide, before it has built up: a low, wide and late peak, false damping",
                advice=f"sweep at {rate:g} Hz/s or slower, over a narrower range if that takes too long; or step",
                changes={"rate": rate},
            )
        )  # fmt: skip
    return found
