"""Grid too coarse: the resonance lies between two steps, its height and width are guesses."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import numpy as np

from twin.procedures import SteppedSine, StepResult
from twin.procedures.grid import fixed_frequencies
from twin.rehearsal.checks.dwell import transient_left
from twin.rehearsal.rehearsal import Caution, Rehearsal

__all__ = ["check_grid", "phase_steps", "steepest_linear"]

ALLOWED_DEGREES = 80.0
"""Phase of the response between neighbouring steps.  At worst the peak lies half way: cos 40 degrees, a quarter low."""
MARGIN_DEGREES = 45.0
"""What a bent resonance turns faster than a linear one before it jumps."""
MOST_TRANSIENT = 0.2


def check_grid(rehearsal: Rehearsal) -> list[Caution]:
    """Look for steps over which the phase turns farther than allowed, and not as far as only a jump does."""
    if not isinstance(rehearsal.procedure, SteppedSine):
        return []
    found = []
    for sweep, steps in rehearsal.sweeps().items():
        turns = phase_steps(rehearsal, steps)
        coarse = [i for i, turn in enumerate(turns) if ALLOWED_DEGREES < turn <= steepest_linear(rehearsal, steps, i)]
        if not coarse:
            continue
        worst = max(coarse, key=lambda i: turns[i])
        here, there = steps[worst], steps[worst + 1]
        width_Hz = 2 * rehearsal.half_width_Hz(here.frequency_Hz)
        gap_Hz = abs(there.frequency_Hz - here.frequency_Hz)
        found.append(
            Caution(
                kind="grid-too-coarse", severity="warning", sweep=sweep, index=there.index,
                frequency_Hz=there.frequency_Hz, steps=len(coarse),
                reason=f"the phase turns by {turns[worst]:.0f} degrees from {here.frequency_Hz:g} to "
                f"{there.frequency_Hz:g} Hz, a step of {gap_Hz:.3g} Hz where the resonance is {width_Hz:.2g} Hz wide: "
                "the peak lies between",
                advice="refine the grid where the response changes (an adaptive grid)",
                changes=_changes(rehearsal, rehearsal.procedure, width_Hz),
            )
        )  # fmt: skip
    return found


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
    """The most that a linear resonance of the believed width can turn from one step to the next, with a margin."""
    gap_Hz = abs(steps[index + 1].frequency_Hz - steps[index].frequency_Hz)
    half_Hz = rehearsal.half_width_Hz(steps[index].frequency_Hz)
    return 2 * math.degrees(math.atan(gap_Hz / (2 * half_Hz))) + MARGIN_DEGREES


def _changes(rehearsal: Rehearsal, procedure: SteppedSine, width_Hz: float) -> dict[str, object]:
    frequencies = fixed_frequencies(procedure)
    widest = max(b - a for a, b in itertools.pairwise(frequencies))
    smallest = 0.1 * width_Hz
    if procedure.grid is not None and procedure.grid.smallest is not None:
        smallest = min(smallest, 0.5 * procedure.grid.smallest)
    grid = {
        "kind": "adaptive",
        "start": frequencies[0],
        "stop": frequencies[-1],
        # a first step beyond the resonance's own width could pass over it
        "step": float(f"{max(min(widest, 1.5 * width_Hz), 2 * smallest):.3g}"),
        "smallest": float(f"{smallest:.2g}"),
        "change": 0.3,
    }
    return {"grid": grid, "frequencies": None}
