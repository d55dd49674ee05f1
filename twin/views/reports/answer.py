"""What diagnoses and identifications say, and why this and nothing else, as tables and sentences."""

from collections.abc import Iterable, Mapping, Sequence

from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.exclusion import Exclusion
from twin.diagnose.answer.gain import Gain
from twin.diagnose.answer.parameter_text import parameters_text
from twin.diagnose.answer.result import IN_WORDS, NamedCause
from twin.diagnose.posterior import Weighed
from twin.diagnose.selection.search import Stage
from twin.identify.rms import rms
from twin.views.table import Table


def sentences(warnings: Iterable[str]) -> list[str]:
    """Warnings, which are parts of a line, as sentences."""
    return [f"{text[0].upper()}{text[1:]}." for text in warnings]


def frequencies_table(
    modes: Iterable[int], measured_Hz: Iterable[float], before_Hz: Iterable[float], after_Hz: Iterable[float],
    *, after: str, more: Mapping[str, Sequence[str]] | None = None,
) -> Table:  # fmt: skip
    """Natural frequencies with their errors before, and after what is called `after`; `more` are further columns."""

    def with_error(measured: float, modelled: float) -> tuple[str, str]:
        return f"{modelled:.5g}", f"{100 * (modelled / measured - 1):+.2f} %"

    more = more or {}
    rows = [
        (str(n), f"{f:.5g}", *with_error(f, was), *with_error(f, now), *rest)
        for n, f, was, now, *rest in zip(modes, measured_Hz, before_Hz, after_Hz, *more.values(), strict=True)
    ]
    head = ("mode", "measured", "as assumed", "error", after, "error", *more)
    caption = "Natural frequencies in Hz; errors are model over measured, minus one"
    return Table(caption=caption, head=head, rows=rows, numbers=range(len(head)))


def residual_rows(sweeps: Sequence[SweepComparison]) -> list[tuple[str, str, float, float]]:
    """Sweep, channel, and the root-mean-square residual in standard deviations before and after."""
    return [
        (sweep.sweep, channel, rms(sweep.residual_before[:, i]), rms(sweep.residual_after[:, i]))
        for sweep in sweeps
        for i, channel in enumerate(sweep.channels)
    ]


def causes_table(causes: Sequence[NamedCause]) -> Table:
    """What is named, and what could be instead."""
    return Table(
        caption="Most probable first; parameters with one standard deviation",
        head=("cause", "parameters", "probability", "in the model", "could be confused with"),
        rows=[
            (
                cause.cause,
                parameters_text(cause.parameters),
                f"{cause.probability:.3f}",
                "yes" if cause.in_model else "no",
                ", ".join(cause.confused_with) or "nothing listed",
            )
            for cause in causes
        ],
        numbers=(2,),
    )


def excluded_table(excluded: Sequence[Exclusion]) -> Table:
    """The largest size of each cause that the data could hide, the tightest first."""
    return Table(
        caption="The largest distance from no effect that could hide, with 95 %",
        head=("cause", "could hide", "best hidden"),
        rows=[(limit.cause, limit.in_words, parameters_text(limit.where)) for limit in excluded],
    )


def errors_table(gain: Gain, *, several: bool) -> Table:
    """Errors on what was held out; `several` if the accepted model is another than the base family."""
    caption = "Root-mean-square relative error of the complex response over the held-out steps"
    if len(gain.by_harmonic) > 1:
        caption += ", fundamental and second harmonic where it stands out, each relative to itself"
    rows = [("nominal rig, base family refitted", f"{100 * gain.before:.2f} %")]
    if several:
        rows.append(("extended model", f"{100 * gain.after:.2f} %"))
    rows.append(("what a right model leaves", f"{100 * gain.expected:.2f} %"))
    rows.append(("noise floor of the measurement", f"{100 * gain.noise_floor:.2f} %"))
    return Table(caption=caption, head=("model", "error"), rows=rows, numbers=(1,))


def residuals_table(sweeps: Sequence[SweepComparison], *, several: bool) -> Table:
    """Residuals by sweep and channel; `several` if before and after are two models."""
    rows = residual_rows(sweeps)
    return Table(
        caption="Root-mean-square residual of the fundamental, in standard deviations of its noise",
        head=("sweep", "channel", "before", "after") if several else ("sweep", "channel", "residual"),
        rows=[
            (sweep, channel, *(f"{value:.3g}" for value in ((before, after) if several else (after,))))
            for sweep, channel, before, after in rows
        ],
        numbers=(2, 3) if several else (2,),
    )


def scores_table(stage: Stage) -> Table:
    """The best place of each of the best causes, by its expected gain of log evidence."""
    best: dict[str, float] = {}
    for score in stage.scores:
        best.setdefault(score.hypothesis.key, score.log_bayes)
    return Table(
        caption="Expected gain of log evidence by each cause, to first order, at its best place",
        head=("cause", "expected gain of log evidence"),
        rows=[(key, f"{gain:+.4g}") for key, gain in list(best.items())[:8]],
        numbers=(1,),
    )


def rivals_table(hypotheses: Sequence[Weighed], temperature: float) -> Table:
    """By how much the most probable hypothesis is ahead of each other one; evidences count by the temperature."""
    best, *others = sorted(hypotheses, key=lambda one: one.log_evidence / temperature + one.log_prior, reverse=True)
    leader = IN_WORDS.get(best.name, best.name)
    return Table(
        caption=f"How far {leader} is ahead of its rivals, in natural logarithms of odds (3 is 20 to 1)",
        head=("rival", "by the data", "by what is usual beforehand"),
        rows=[
            (
                IN_WORDS.get(one.name, one.name),
                f"{(best.log_evidence - one.log_evidence) / temperature:+.1f}",
                f"{best.log_prior - one.log_prior:+.1f}",
            )
            for one in others
        ],
        numbers=(1, 2),
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
