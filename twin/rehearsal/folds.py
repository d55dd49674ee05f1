"""Where predicted branches fold, and which step of a sweep jumps there."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from twin.procedures import StepResult
from twin.rehearsal.branches import turning_points
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.rehearsal import Rehearsal
from twin.rehearsal.turns import phase_steps, steepest_linear


@dataclass(frozen=True)
class Folds:
    """Frequencies, Hz, where a sweep upwards and one downwards must leave the branch of one force.

    `intervals_Hz` are the lower and the upper end of each stretch that the curve passes more than once.
    """

    up_Hz: tuple[float, ...] = ()
    down_Hz: tuple[float, ...] = ()
    intervals_Hz: tuple[tuple[float, float], ...] = ()


def folds_within(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> Folds:
    """The folds of the branches at a sweep's force, between its first and its last frequency."""
    if len({step.frequency_Hz for step in steps}) < 2:
        return Folds()
    low, high = min(step.frequency_Hz for step in steps), max(step.frequency_Hz for step in steps)
    places, intervals = [], []
    for branch in branches_of(rehearsal, steps):
        along = [point for point in turning_points(branch["frequency_Hz"]) if low <= point[0] <= high]
        places += along
        intervals += _intervals(along)
    return Folds(
        up_Hz=tuple(sorted(place for place, ahead in places if ahead)),
        down_Hz=tuple(sorted(place for place, ahead in places if not ahead)),
        intervals_Hz=tuple(intervals),
    )


def _intervals(places: Sequence[tuple[float, bool]]) -> list[tuple[float, float]]:
    """Along the curve, each turn backwards belongs to the turn forwards that comes next."""
    found = []
    for i, (place, ahead) in enumerate(places):
        if ahead and i + 1 < len(places):
            other = places[i + 1][0]
            found.append((min(place, other), max(place, other)))
        elif ahead or i == 0:  # the other one lies outside of what is swept
            found.append((place, place))
    return found


def jumping_steps(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> list[int]:
    """Numbers i of the steps over which, from i to i + 1, the response leaves one branch for another.

    Those where the branch folds, as far as it is known, and those whose phase turns farther than any linear resonance
    of the assumed width can.
    """
    turns = phase_steps(rehearsal, steps)
    if not turns:
        return []
    found = {
        i for i, turn in enumerate(turns) if turn > max(LIMITS.turns_allowed_deg, steepest_linear(rehearsal, steps, i))
    }
    folds = folds_within(rehearsal, steps)
    upwards = steps[-1].frequency_Hz > steps[0].frequency_Hz
    for fold_Hz in folds.up_Hz if upwards else folds.down_Hz:
        near = [i for i in range(len(steps) - 1) if _is_near(rehearsal, steps[i], steps[i + 1], fold_Hz)]
        found.add(max(near, key=lambda i: turns[i]))
    return sorted(found)


def _is_near(rehearsal: Rehearsal, here: StepResult, there: StepResult, fold_Hz: float) -> bool:
    """Whether a step passes the fold, but for what shaker and transient may move the jump by."""
    low, high = sorted((here.frequency_Hz, there.frequency_Hz))
    margin_Hz = rehearsal.half_width_Hz(fold_Hz)
    return low - margin_Hz <= fold_Hz <= high + margin_Hz


def branches_of(rehearsal: Rehearsal, steps: Sequence[StepResult]) -> list[Mapping[str, Any]]:
    """The predicted curves at a sweep's force, one about each resonance."""
    target = steps[0].target_amplitude
    return [b for b in rehearsal.nominal.branches if math.isclose(b["force_N"], target, rel_tol=1e-6)]
