"""What part of a measured step is a transient still."""

import math

from twin.procedures import StepResult
from twin.rehearsal.rehearsal import Rehearsal


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
