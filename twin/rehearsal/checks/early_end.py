"""Branch ends early: beyond it nothing is known of folds, and a jump there is not foretold."""

from collections.abc import Iterator

from twin.rehearsal.folds import branches_of
from twin.rehearsal.rehearsal import Caution, Rehearsal


def check_early_ends(rehearsal: Rehearsal) -> Iterator[Caution]:
    """Report the sweeps whose predicted curve stops before their last frequency."""
    for sweep, steps in rehearsal.sweeps().items():
        reason = next(
            (branch["ends_early"] for branch in branches_of(rehearsal, steps) if branch.get("ends_early")), ""
        )
        if reason:
            yield Caution(
                kind="branch-ends-early", severity="note", sweep=sweep, index=steps[0].index,
                frequency_Hz=steps[0].frequency_Hz, steps=len(steps),
                reason=f"the predicted branch ends early, at {reason}: folds beyond are not known",
                advice="look out for jumps that no warning foretells", changes={},
            )  # fmt: skip
