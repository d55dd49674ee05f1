"""Dwell too short: the transient of one step is measured as the response of the next.

The peak comes out low and wide, the Q too small, and sweeps up and down differ as if the joint had hysteresis.
"""

import math
from collections.abc import Iterator, Sequence

from twin.procedures import Dwell, Multisine, Procedure, RingDown, SteppedSine, StepResult
from twin.rehearsal.checks.changes import longer_wait
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Caution, Rehearsal
from twin.rehearsal.turns import transient_left


def check_dwell(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Judge each sweep by its worst step; a multisine by what its periods told of the transient."""
    procedure = rehearsal.procedure
    if isinstance(procedure, Multisine):
        yield from (_restless(procedure, step) for step in rehearsal.result.steps if not _repeats(step))
        return
    for sweep, steps in rehearsal.sweeps().items():
        left = [transient_left(rehearsal, step, before) for before, step in zip([None, *steps], steps, strict=False)]
        worst = max(range(len(steps)), key=lambda i: left[i])
        short = sum(one > LIMITS.dwell_allowed for one in left)
        if not short:
            continue
        step = steps[worst]
        tau_s = rehearsal.time_constant_s(step.frequency_Hz)
        wait = f"{step.settle_s:.3g} s" + (" at most" if step.settled is False else "")
        reason = (
            f"after {wait} {_part(left[worst])} of the response is still a transient "
            f"(it decays with {tau_s:.2g} s): false damping" + _hysteresis(rehearsal, sweep, steps)
        )
        wanted_s = tau_s * math.log(max(min(left[worst], 1.0) / 1e-3, math.e)) + step.settle_s
        yield Caution.at(
            step, kind="dwell-too-short", severity="warning", steps=short, size=left[worst], reason=reason,
            advice=f"let the wait end when the data have settled, about {wanted_s:.2g} s here",
            changes=_changes(procedure, tau_s),
        )  # fmt: skip


def _repeats(step: StepResult) -> bool:
    return bool(step.settled) or (step.remaining is not None and step.remaining <= LIMITS.dwell_allowed)


def _restless(procedure: Multisine, step: StepResult) -> Caution:
    left = "nobody knows how much" if step.remaining is None else _part(step.remaining)
    return Caution.at(
        step, kind="dwell-too-short", severity="warning", frequency_Hz=0.0, steps=1,
        reason=f"after {step.settle_s:.3g} s {left} of the response is still a transient: its periods do not repeat",
        advice="let the wait end when the periods repeat",
        changes=longer_wait(procedure, most_s=float(round(3 * step.settle_s)), tolerance=2e-3),
    )  # fmt: skip


def _part(left: float) -> str:
    return "most" if left > 0.5 else f"about {100 * left:.2g} %"


def _hysteresis(rehearsal: Rehearsal, sweep: str, steps: Sequence[StepResult]) -> str:
    """How far the sweep in the other direction differs, where there is one."""
    turned = sweep.removesuffix("-up") + "-down" if sweep.endswith("-up") else sweep.removesuffix("-down") + "-up"
    other = {round(step.frequency_Hz, 6): step for step in rehearsal.sweeps().get(turned, [])}
    channel = rehearsal.response_channel(steps)
    worst, at = 0.0, 0.0
    for step in steps:
        back = other.get(round(step.frequency_Hz, 6))
        if back is not None and channel is not None:
            here, there = abs(step.phasors.get(channel, 0j)), abs(back.phasors.get(channel, 0j))
            difference = abs(here - there) / max(here, there, 1e-300)
            worst, at = max((worst, at), (difference, step.frequency_Hz))
    return f" and false hysteresis, {100 * worst:.2g} % at {at:g} Hz" if worst > 0.05 else ""


def _changes(procedure: Procedure, tau_s: float) -> dict[str, object]:
    if not isinstance(procedure, (SteppedSine, Dwell, RingDown)):
        return {}
    changes = longer_wait(procedure, most_s=float(round(25 * tau_s)))
    if isinstance(procedure, SteppedSine) and (procedure.measure.seconds or 0.0) < 1.0:
        changes["measure"] = {"seconds": 2.0}
    return changes
