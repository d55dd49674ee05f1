"""Force drop-out: the held amplitude falls and the controller cannot bring it back."""

from __future__ import annotations

from twin.procedures import Multisine, Random, StepResult, SweptSine
from twin.rehearsal.checks.amplitudes import amplitudes_at_most
from twin.rehearsal.rehearsal import Caution, Rehearsal

__all__ = ["check_drop_out"]


def check_drop_out(rehearsal: Rehearsal) -> list[Caution]:
    """Judge each sweep by its worst amplitude error."""
    procedure = rehearsal.procedure
    if isinstance(procedure, SweptSine):
        return []
    tolerance = procedure.controller.tolerance
    found = []
    for sweep in dict.fromkeys(step.sweep for step in rehearsal.result.steps):
        steps = [step for step in rehearsal.result.steps if step.sweep == sweep]
        lost = [step for step in steps if abs(step.amplitude_error) > tolerance + 3 * _uncertainty(step)]
        if not lost:
            continue
        worst = max(lost, key=lambda step: abs(step.amplitude_error))
        weak = [step for step in lost if _at_limit(rehearsal, step)]
        if weak:
            reach = 0.95 * min(step.amplitude for step in weak)
            why = f"the generator is at its limit of {procedure.limits.voltage:g} V"
            advice = f"no more than {reach:.3g} can be held here; raise limits.voltage if the amplifier has it"
            changes = amplitudes_at_most(procedure, worst.target_amplitude, reach)
        else:
            why = f"the controller had {worst.settle_s:.3g} s"
            advice = "let the wait end when amplitude and response have settled"
            broadband = isinstance(procedure, (Random, Multisine))
            changes = {} if broadband else {"settle": {"tolerance": 5e-4, "maximum": 60.0}}
        found.append(
            Caution(
                kind="force-drop-out", severity="warning", sweep=sweep, index=worst.index,
                frequency_Hz=worst.frequency_Hz, steps=len(lost),
                reason=f"{worst.target_channel} is {worst.amplitude:.4g} instead of {worst.target_amplitude:.4g} "
                f"({100 * worst.amplitude_error:+.2g} %): {why}",
                advice=advice, changes=changes,
            )
        )  # fmt: skip
    return found


def _uncertainty(step: StepResult) -> float:
    return step.std.get(step.target_channel, 0.0) / step.target_amplitude if step.target_amplitude else 0.0


def _at_limit(rehearsal: Rehearsal, step: StepResult) -> bool:
    return step.amplitude_error < 0 and step.voltage_V >= 0.999 * rehearsal.procedure.limits.voltage
