"""The rule of the verdict: from the selection to the probability of every hypothesis, and to what is honest to say."""

from dataclasses import dataclass

import numpy as np

from twin.diagnose.answer.result import Estimate, NamedCause, Verdict
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.diagnose.places import told_place
from twin.diagnose.posterior import LOG_ODDS_OF_UNKNOWN, Weighed, log_weight, probabilities, smallest_set, temperature
from twin.diagnose.selection.search import Search, Stage
from twin.diagnose.signals import Finding, Sidebands
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies


@dataclass(frozen=True)
class Posterior:
    """Hypotheses with their probabilities."""

    models: tuple[FittedModel, ...]
    """Most probable first."""
    probability: np.ndarray
    """Array (m,)."""
    unknown: float
    """Of something that is on no list."""
    weighed: tuple[Weighed, ...] = ()
    """What the probabilities are made of, in no order; empty where the time did not allow for any."""

    @property
    def set_95(self) -> tuple[str, ...]:
        """The fewest hypotheses that hold 95 %."""
        return smallest_set(
            [*(model.name for model in self.models), "unknown"], np.append(self.probability, self.unknown)
        )


def posterior_of(search: Search, sidebands: Sidebands | None = None) -> Posterior:
    """Probabilities of the selected model, of its rivals in the stage that chose it, and of something unknown.

    Where nothing was selected, the rivals are those that were tried.

    Parameters
    ----------
    sidebands
        What the samples hold beside all that repeats with the drive: only something unknown leaves any.
    """
    evidence = search.evidence
    chosen = [stage for stage in search.stages if stage.accepted]
    stage = chosen[-1] if chosen else search.stages[-1]
    if not stage.complete:
        return Posterior((stage.before,), np.zeros(1), 1.0)
    models = (stage.before, *_counted(evidence, stage))
    weights = [log_weight(evidence, model) for model in models]
    best = models[int(np.argmax(weights))]
    # As the last stage has it: recordings that were reduced against a model far off need errors that are not the rig's.
    last = next(each for each in reversed(search.stages) if each.complete)
    more = last.unknown - last.best.log_evidence + (sidebands.log_bayes if sidebands is not None else 0.0)
    unknown = max(weights) + more / temperature(evidence) + LOG_ODDS_OF_UNKNOWN
    *each, of_unknown = probabilities([*weights, unknown])
    order = np.argsort(each)[::-1]
    evidences = [*(model.log_evidence for model in models), best.log_evidence + more]
    weighed = tuple(
        Weighed(name, len(model.hypotheses), log_evidence, weight - log_evidence / temperature(evidence))
        for name, model, log_evidence, weight in zip(
            [*(model.name for model in models), "unknown"], [*models, best], evidences, [*weights, unknown], strict=True
        )
    )
    return Posterior(tuple(models[i] for i in order), np.asarray(each)[order], float(of_unknown), weighed)


def _counted(evidence: MeasuredData, stage: Stage) -> tuple[FittedModel, ...]:
    """Rivals that promise a gain: of recordings only these are fitted, of frequencies the fits say which they are."""
    if not isinstance(evidence, MeasuredFrequencies):
        return stage.rivals
    none = log_weight(evidence, stage.before)
    return tuple(rival for rival in stage.rivals if log_weight(evidence, rival) > none)


def decide(posterior: Posterior, findings: list[Finding]) -> Verdict:
    """The verdict: what holds 95 % of the probability by itself, else ``ambiguous``."""
    if len(posterior.set_95) > 1:
        return "ambiguous"
    (name,) = posterior.set_95
    if name == "unknown":
        return "unknown"
    return "none" if name == "none" and not findings else "explained"


def rivals_of(posterior: Posterior) -> tuple[FittedModel, ...]:
    """Other models in the set that holds 95 %, the most probable first."""
    return tuple(model for model in posterior.models[1:] if model.name in posterior.set_95 and model.hypotheses)


def named_causes(
    search: Search, posterior: Posterior, findings: list[Finding], verdict: Verdict
) -> tuple[NamedCause, ...]:
    """All causes worth a line, those in the model and their rivals, most probable first."""
    named = [
        NamedCause(
            cause=finding.cause,
            summary=finding.summary,
            probability=0.99,
            confused_with=(),
            parameters={
                **finding.names,
                **{name: Estimate(value, finding.std[name]) for name, value in finding.values.items()},
            },
            in_model=True,
        )
        for finding in findings
    ]
    others = tuple(name for name in posterior.set_95 if name not in (posterior.models[0].name, "none", "unknown"))
    in_model = {hypothesis.key for hypothesis in search.model.hypotheses}
    told: set[str] = set()
    for model, p in zip(posterior.models, posterior.probability, strict=True):
        source = search.model if {h.key for h in model.hypotheses} == in_model else model
        if p < LIMITS.worth_a_line and source is not search.model:
            continue
        for hypothesis in source.hypotheses:
            if hypothesis.key not in told:
                told.add(hypothesis.key)
                taken = hypothesis.key in in_model and verdict != "unknown"
                named.append(_named(search.evidence, hypothesis, float(p), others if taken else (), taken))
    return tuple(sorted(named, key=lambda cause: (-cause.in_model, -cause.probability)))


def _named(
    evidence: MeasuredData, hypothesis: CauseHypothesis, probability: float, rivals: tuple[str, ...], in_model: bool
) -> NamedCause:
    parameters: dict[str, Estimate | str | tuple[int, ...]] = dict(hypothesis.label)
    values, std, nodes = told_place(
        evidence, hypothesis.label, *hypothesis.cause.reported(hypothesis.values, hypothesis.std)
    )
    parameters.update({key: Estimate(value, std.get(key, 0.0)) for key, value in values.items()})
    if nodes:
        parameters["nodes_95"] = nodes
    return NamedCause(
        cause=hypothesis.cause.name,
        summary=hypothesis.cause.summary,
        probability=probability,
        confused_with=rivals,
        parameters=parameters,
        in_model=in_model,
    )
