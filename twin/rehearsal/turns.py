"""From step to step: what of a response is a transient still, how far its phase turns, and how far a linear one can."""

import math
from collections.abc import Sequence

import numpy as np

from twin.procedures import StepResult
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Rehearsal

MOST_TRANSIENT = 0.2


def transient_left(rehearsal: Rehearsal, step: StepResult, before: StepResult | None) -> float:
    """What part of a measured response is transient, as far as the measurement shows.

    A step that settled by the data is assumed.  Otherwise the drift between the halves of the measurement tells: with
    the time constant tau, deviations averaged over the halves of T differ by a known part of their mean.  A
    measurement too short to have halves is judged by how far the response had to go.
    """
    if step.settled:
        return 0.0
    tau_s = rehearsal.time_constant_s(step.frequency_Hz)
    if step.drift is not None:
        half = math.exp(-step.measure_s / (2 * tau_s))
        # means of exp(-t/tau) over both halves are as 1 : half; their mean over their difference
        return step.drift * 0.5 * (1 + half) / (1 - half)
    if before is None:
        return 0.0
    changes = [
        abs(phasor - before.phasors[name]) / abs(phasor)
        for name, phasor in step.phasors.items()
        if name in before.phasors and phasor and name in rehearsal.response_channels
    ]
    return max(changes, default=0.0) * math.exp(-step.settle_s / tau_s)


def phase_steps(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> list[float]:
    """By how many degrees the largest response turns from each step to the next; 0 where that says nothing.

    The step from one resonance to the next is such a place.
    """
    if rehearsal.procedure.procedure != "stepped-sine" or len({s.frequency_Hz for s in steps}) < 2:
        return []
    H, near = rehearsal.receptances(steps), rehearsal.near_resonance(steps)
    within = [False] * (len(steps) - 1)
    for band in rehearsal.bands(steps):
        for i in range(min(band), max(band)):
            within[i] = True
    # a transient has a phase of its own: nothing is to be learnt from it about grid or jumps
    still = [transient_left(rehearsal, step, None) < MOST_TRANSIENT for step in steps]
    turns = np.degrees(abs(np.angle(H[1:] * np.conj(H[:-1]))))
    return [
        float(turn) if within[i] and (near[i] or near[i + 1]) and still[i] and still[i + 1] else 0.0
        for i, turn in enumerate(turns)
    ]


def steepest_linear(rehearsal: Rehearsal, steps: Sequence[StepResult], index: int) -> float:
    """The most that a linear resonance of the assumed width can turn from one step to the next, with a margin."""
    gap_Hz = abs(steps[index + 1].frequency_Hz - steps[index].frequency_Hz)
    half_Hz = rehearsal.half_width_Hz(steps[index].frequency_Hz)
    return 2 * math.degrees(math.atan(gap_Hz / (2 * half_Hz))) + LIMITS.turns_margin_deg
