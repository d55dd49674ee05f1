"""How far the phase of the response turns from step to step, and how far a linear resonance can turn it."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.procedures import StepResult
from twin.rehearsal.rehearsal import Rehearsal
from twin.rehearsal.transient import transient_left

__all__ = ["ALLOWED_DEGREES", "phase_steps", "steepest_linear"]

ALLOWED_DEGREES = 80.0
"""Phase of the response between neighbouring steps.  At worst the peak lies half way: cos 40 degrees, a quarter low."""
MARGIN_DEGREES = 45.0
"""What a bent resonance turns faster than a linear one before it jumps."""
MOST_TRANSIENT = 0.2


def phase_steps(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> list[float]:
    """By how many degrees the largest response turns from each step to the next; 0 where that says nothing."""
    channel = rehearsal.response_channel(steps)
    if channel is None or rehearsal.procedure.procedure != "stepped-sine" or len({s.frequency_Hz for s in steps}) < 2:
        return []
    H = np.array([rehearsal.transfer(step, channel) for step in steps])
    seen = abs(H) > 0.02 * abs(H).max()
    # a transient has a phase of its own: nothing is to be learnt from it about grid or jumps
    still = [transient_left(rehearsal, step, None) < MOST_TRANSIENT for step in steps]
    turns = np.degrees(abs(np.angle(H[1:] * np.conj(H[:-1]))))
    return [
        float(turns[i]) if (seen[i] or seen[i + 1]) and still[i] and still[i + 1] else 0.0 for i in range(len(turns))
    ]


def steepest_linear(rehearsal: Rehearsal, steps: Sequence[StepResult], index: int) -> float:
    """The most that a linear resonance of the assumed width can turn from one step to the next, with a margin."""
    gap_Hz = abs(steps[index + 1].frequency_Hz - steps[index].frequency_Hz)
    half_Hz = rehearsal.half_width_Hz(steps[index].frequency_Hz)
    return 2 * math.degrees(math.atan(gap_Hz / (2 * half_Hz))) + MARGIN_DEGREES
