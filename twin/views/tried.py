"""Why one cause and not another: what the search scored, and what it fitted."""

from __future__ import annotations

from twin.diagnose.forward_selection import Stage
from twin.views.table import Table

__all__ = ["fitted_table", "scores_table"]

MOST_SCORES = 8


def scores_table(stage: Stage) -> Table:
    """The best place of each of the best causes, by what it would take off chi2."""
    best: dict[str, float] = {}
    for score in stage.scores:
        best[score.hypothesis.key] = max(best.get(score.hypothesis.key, 0.0), score.gain)
    ranked = sorted(best.items(), key=lambda item: -item[1])[:MOST_SCORES]
    return Table(
        caption="What each cause would take off chi², to first order, at its best place",
        head=("cause", "expected fall of chi²"),
        rows=[(key, f"{gain:.4g}") for key, gain in ranked],
        numbers=(1,),
    )


def fitted_table(stage: Stage, *, caption: str) -> Table:
    """The models of one turn; evidence is weighed with what even the best of them misses its noise by."""
    rows = []
    if stage.finalists:
        overdispersion = stage.finalists[0].chi2_per_dof
        top = stage.finalists[0].weight(overdispersion)
        rows = [
            (
                " + ".join(hypothesis.key for hypothesis in model.hypotheses) or "nothing",
                f"{model.chi2_per_dof:.3g}",
                f"{model.weight(overdispersion) - top:+.1f}",
                "yes" if stage.accepted and model is stage.finalists[0] else "no",
            )
            for model in stage.finalists
        ]
    head = ("named", "chi² per degree of freedom", "log evidence, above the first", "taken")
    return Table(caption=caption, head=head, rows=rows, numbers=(1, 2))
