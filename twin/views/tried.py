"""Why one cause and not another: what the search scored, and what it fitted."""

from twin.diagnose.search import Stage
from twin.views.table import Table

MOST_SCORES = 8


def scores_table(stage: Stage) -> Table:
    """The best place of each of the best causes, by its expected gain of log evidence."""
    best: dict[str, float] = {}
    for score in stage.scores:
        best.setdefault(score.hypothesis.key, score.log_bayes)
    return Table(
        caption="Expected gain of log evidence by each cause, to first order, at its best place",
        head=("cause", "expected gain of log evidence"),
        rows=[(key, f"{gain:+.4g}") for key, gain in list(best.items())[:MOST_SCORES]],
        numbers=(1,),
    )


def fitted_table(stage: Stage, *, caption: str) -> Table:
    """The models of one turn, the model without a further cause last."""
    rows = [
        (
            " + ".join(hypothesis.key for hypothesis in model.hypotheses) or "nothing",
            f"{model.errors.steps.stiffness:.1e}",
            f"{model.log_evidence - stage.before.log_evidence:+.1f}",
            "yes" if stage.accepted and model is stage.rivals[0] else "no",
        )
        for model in (*stage.rivals, stage.before)
    ]
    head = ("named", "error of stiffness", "log evidence", "taken")
    return Table(caption=caption, head=head, rows=rows, numbers=(1, 2))
