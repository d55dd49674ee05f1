"""Swept sine too fast: the resonance has no time to build up; its peak comes out low, wide and late."""

from collections.abc import Iterator

from twin.procedures import SweptSine
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_sweep_rate(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep by the resonance that it met."""
    procedure = rehearsal.procedure
    if not isinstance(procedure, SweptSine):
        return
    for step in rehearsal.result.steps:
        if step.peak_frequency_Hz is None:
            continue
        half_Hz = rehearsal.half_width_Hz(step.peak_frequency_Hz)
        fastest = LIMITS.sweep_rate_fastest * half_Hz**2
        if procedure.rate <= fastest:
            continue
        rate = float(f"{LIMITS.sweep_rate_wanted * fastest:.2g}")
        yield Caution(
            kind="sweep-too-fast", severity="warning", sweep=step.sweep, index=step.index,
            frequency_Hz=step.peak_frequency_Hz, steps=1,
            reason=f"{procedure.rate:g} Hz/s passes the resonance near {step.peak_frequency_Hz:.4g} Hz, which is "
            f"{2 * half_Hz:.2g} Hz wide, before it has built up: a low, wide and late peak, false damping",
            advice=f"sweep at {rate:g} Hz/s or slower, over a narrower range if that takes too long; or step",
            changes={"rate": rate},
        )  # fmt: skip
