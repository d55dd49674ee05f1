"""What a diagnosis keeps back for measuring the gain, where no run is held out."""

from dataclasses import replace

import numpy as np

from twin.diagnose.limits import LIMITS
from twin.identify.measured_data import MeasuredData


def set_aside(evidence: MeasuredData) -> tuple[MeasuredData, MeasuredData | None, tuple[str, ...]]:
    """Keep the sweep of middle force back; of one or two sweeps every fourth step, where that leaves enough.

    Returns
    -------
    kept, unseen : MeasuredData
        What to learn from, and what to measure the gain on; no `unseen` where there are too few steps.
    told : tuple of str
        What was set aside, in words.
    """
    states = evidence.steps.states
    sweeps = evidence.steps.by_sweep
    inside = np.zeros(len(states), bool)
    if len(sweeps) >= 3:
        chosen = sorted(sweeps, key=lambda name: states[sweeps[name][0]].target_amplitude)[len(sweeps) // 2]
        inside[sweeps[chosen]] = True
        told = [chosen]
    elif len(states) >= LIMITS.set_aside_enough:
        inside[2::4] = True
        told = [f"every fourth step of {name}" for name in sweeps]
    else:
        return evidence, None, ()
    rest = replace(evidence, steps=evidence.steps.select(~inside))
    return rest, replace(evidence, steps=evidence.steps.select(inside), broadband=()), tuple(told)
