"""Force drop-out, and its contrary: the held amplitude is too low or too high, and the controller cannot bring it back.

Near a resonance the force falls, as the shaker meets a structure that moves; behind it, it comes back with a surplus.
"""

from collections.abc import Iterator, Sequence

from twin.procedures import Dwell, Impact, RingDown, SteppedSine, StepResult, SweptSine
from twin.rehearsal.checks.changes import amplitudes_at_most, longer_wait
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.refine import finer_grid
from twin.rehearsal.rehearsal import Caution, Rehearsal, by_sweep


def check_drop_out(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep by the step with too little and by the one with too much."""
    procedure = rehearsal.procedure
    if isinstance(procedure, (SweptSine, Impact)):
        return
    tolerance = procedure.controller.tolerance
    for steps in by_sweep(rehearsal.result.steps).values():
        off = [step for step in steps if abs(step.amplitude_error) > tolerance + 3 * _uncertainty(step)]
        for low in (True, False):
            if concerned := [step for step in off if (step.amplitude_error < 0) == low]:
                yield _caution(rehearsal, concerned)


def _caution(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> Caution:
    worst = max(steps, key=lambda step: abs(step.amplitude_error))
    low = worst.amplitude_error < 0
    held = "force" if worst.target_channel == rehearsal.force_channel else "response"
    all_of_it = 0.999 * rehearsal.procedure.limits.voltage
    at_limit = [step for step in steps if step.amplitude_error < 0 and step.voltage_V >= all_of_it]
    why, advice, changes = _remedy(rehearsal, worst, at_limit)
    return Caution.at(
        worst, kind=f"{held}-drop-out" if low else f"{held}-too-high", severity="warning",
        steps=len(steps), channel=worst.target_channel, size=abs(worst.amplitude_error),
        reason=f"{worst.target_channel} is {worst.amplitude:.4g} instead of {worst.target_amplitude:.4g}, "
        f"{100 * abs(worst.amplitude_error):.2g} % too {'low' if low else 'high'}: {why}",
        advice=advice, changes=changes,
    )  # fmt: skip


def _remedy(rehearsal: Rehearsal, worst: StepResult, weak: Sequence[StepResult]) -> tuple[str, str, dict[str, object]]:
    """Why the amplitude is off, what helps, and the changes for it; `weak` are the steps at the generator's limit."""
    procedure = rehearsal.procedure
    if weak:
        reach = 0.95 * min(step.amplitude for step in weak)
        return (
            f"the generator is at its limit of {procedure.limits.voltage:g} V",
            f"no more than {reach:.3g} can be held here; raise limits.voltage if the amplifier has it",
            amplitudes_at_most(procedure, worst.target_amplitude, reach),
        )
    had = f"the controller had {worst.settle_s:.3g} s"
    if not isinstance(procedure, (SteppedSine, Dwell, RingDown)):
        return had, "let the wait end when amplitude and response have settled", {}
    if procedure.settle.seconds is not None:
        return had, "let the wait end when amplitude and response have settled", longer_wait(procedure)
    if worst.settled is False:
        return (
            f"{had}, all that the wait may take",
            "allow a longer wait (settle.maximum), a lower amplitude or smaller steps towards this frequency",
            longer_wait(procedure),
        )
    least_s = LIMITS.drop_out_constants * rehearsal.time_constant_s(worst.frequency_Hz)
    changes = longer_wait(procedure, least_s=least_s)
    if isinstance(procedure, SteppedSine):
        changes.update(finer_grid(rehearsal, [(worst.frequency_Hz, worst.frequency_Hz)]))
    return (
        f"it seemed held after {worst.settle_s:.3g} s, but was not when it was measured",
        f"wait at least {least_s:.2g} s (settle.minimum), so that the controller goes on, and take smaller steps "
        f"towards {worst.frequency_Hz:g} Hz; if that is not enough, a lower amplitude there",
        changes,
    )


def _uncertainty(step: StepResult) -> float:
    return step.std.get(step.target_channel, 0.0) / step.target_amplitude if step.target_amplitude else 0.0
