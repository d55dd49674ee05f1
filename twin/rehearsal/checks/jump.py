"""Jump ahead: the branch that a sweep follows folds, and the response leaves it for another.

Where a predicted branch ends early nothing is known of folds, and a jump is not foretold.
"""

from collections.abc import Iterator, Sequence

from twin.procedures import SteppedSine, StepResult
from twin.rehearsal.folds import Folds, branches_of, folds_within, jumping_steps
from twin.rehearsal.limits import LIMITS
from twin.rehearsal.refine import finer_grid
from twin.rehearsal.rehearsal import Caution, Rehearsal
from twin.rehearsal.turns import phase_steps


def check_jumps(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Find steps over which the response jumps, by the predicted branch or by how far the phase turns.

    A procedure that sweeps both ways records both branches: there a jump is worth a note only, as long as the steps
    show where it is.
    """
    if not isinstance(rehearsal.procedure, SteppedSine):
        return
    for steps in rehearsal.sweeps().values():
        jumps = jumping_steps(rehearsal, steps)
        if jumps:
            yield _caution(rehearsal, steps, jumps)


def check_early_ends(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Report the sweeps whose predicted curve stops before their last frequency."""
    for steps in rehearsal.sweeps().values():
        if ends := [told for branch in branches_of(rehearsal, steps) if (told := branch.get("ends_early"))]:
            yield Caution.at(
                steps[0], kind="branch-ends-early", severity="note", steps=len(steps),
                reason=f"the predicted branch ends early, at {ends[0]}: folds beyond are not known",
                advice="look out for jumps that no warning foretells", changes={},
            )  # fmt: skip


def _caution(rehearsal: Rehearsal, steps: Sequence[StepResult], jumps: Sequence[int]) -> Caution:
    turns = phase_steps(rehearsal, steps)
    worst = max(jumps, key=lambda i: turns[i])
    here, there = steps[worst], steps[worst + 1]
    channel = rehearsal.response_channel(steps) or ""
    ratio = abs(there.phasors.get(channel, 0j)) / max(abs(here.phasors.get(channel, 0j)), 1e-300)
    folds = folds_within(rehearsal, steps)
    wide = [
        i for i in jumps if _gap_Hz(steps, i) > LIMITS.jump_widest * 2 * rehearsal.half_width_Hz(steps[i].frequency_Hz)
    ]
    advice, changes = _advice(rehearsal, _is_narrow(rehearsal, folds))
    if wide:
        places = _places(steps, wide, folds)
        advice += "; and take finer steps " + " and ".join(_stretch(low, high) for low, high in places)
        advice += f", where steps of {_gap_Hz(steps, wide[0]):.3g} Hz hide it"
        changes = {**changes, **finer_grid(rehearsal, places)}
    return Caution.at(
        there, kind="jump-ahead", severity="warning" if changes else "note", steps=len(jumps),
        reason=f"the response jumps between {here.frequency_Hz:g} and {there.frequency_Hz:g} Hz: "
        f"{ratio:.2g} times the amplitude, {turns[worst]:.0f} degrees of phase" + _told(folds),
        advice=advice, changes=changes,
    )  # fmt: skip


def _is_narrow(rehearsal: Rehearsal, folds: Folds) -> bool:
    return bool(folds.intervals_Hz) and all(
        0 < high - low < LIMITS.jump_narrowest * 2 * rehearsal.half_width_Hz(low) for low, high in folds.intervals_Hz
    )


def _advice(rehearsal: Rehearsal, narrow: bool) -> tuple[str, dict[str, object]]:
    assert isinstance(rehearsal.procedure, SteppedSine)
    if narrow:
        return "the stretch with two branches is too narrow for sweeps both ways to differ; mind how steep it is", {}
    if rehearsal.procedure.direction == "both":
        return "both branches are recorded; mind the limits at the jump", {}
    return (
        "sweep both ways, so that both branches are recorded; or hold the response, which has no jump",
        {"direction": "both"},
    )


def _told(folds: Folds) -> str:
    ways = [
        f"{way} at " + " and ".join(f"{one:.7g}" for one in sorted(places)) + " Hz"
        for way, places in (("up", folds.up_Hz), ("down", folds.down_Hz))
        if places
    ]
    return "; the predicted branch folds, " + ", ".join(ways) if ways else ""


def _places(steps: Sequence[StepResult], wide: Sequence[int], folds: Folds) -> list[tuple[float, float]]:
    """Where the jumps that the grid hides can be: between the folds, or anywhere in the step if those are not known."""
    found = []
    for i in wide:
        ends = sorted((steps[i].frequency_Hz, steps[i + 1].frequency_Hz))
        between = [(low, high) for low, high in folds.intervals_Hz if low <= ends[1] and high >= ends[0]]
        found += between or [(ends[0], ends[1])]
    return list(dict.fromkeys(found))


def _stretch(low_Hz: float, high_Hz: float) -> str:
    low, high = f"{low_Hz:.5g}", f"{high_Hz:.5g}"
    return f"near {low} Hz" if low == high else f"from {low} to {high} Hz"


def _gap_Hz(steps: Sequence[StepResult], index: int) -> float:
    return abs(steps[index + 1].frequency_Hz - steps[index].frequency_Hz)
