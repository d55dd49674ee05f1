"""From fitted models to an answer: probabilities, rivals, what is honest to say."""

from __future__ import annotations

import numpy as np

from twin.diagnose.fitted_model import CauseHypothesis, FittedModel
from twin.diagnose.forward_selection import Stage
from twin.diagnose.places import told_place
from twin.diagnose.result import Estimate, NamedCause, Verdict
from twin.diagnose.search import Search
from twin.diagnose.signals import Finding
from twin.identify.measured_data import MeasuredData

__all__ = ["RIVAL", "THRESHOLD", "close_rivals", "decide", "last_stage", "named_causes"]

THRESHOLD = 1.0
"""Chi2 per degree of freedom up to which a model agrees with the data on the whole: what a model may be wrong by is
allowed for beside the noise, so that clean rigs of several makes stay below 0.8."""
UNEXPLAINED = 3.0
"""Chi2 per degree of freedom of the base family beyond which something is wrong, though nothing was found."""
LEFT = 1.5
"""Chi2 per number that a model with causes may leave in each part of the evidence: the broadband runs, the steps'
fundamentals, their harmonics.  In blind cases the right cause left no more than 0.9."""
LEFT_SHARE = 0.25
"""Or this share of what the base family had left there: dwells that had not quite settled leave a tenth beside the
right cause, a wrong one more than half."""
SHIFTED = 1e-3
"""Relative error of a natural frequency that a model with causes may put down to no parameter at all.  Right causes
leave less than 1e-4; a wrong pair left 2.4e-3, and followed the data by it."""
RIVAL = 5.0
"""A rival whose log evidence lies no more than this below the best cannot be told from it."""
SURE = 0.95


def decide(search: Search, findings: list[Finding]) -> Verdict:
    """The verdict.

    ``unknown`` where a part of the evidence fails with the causes that were found, or without any.
    """
    if not search.model.hypotheses:
        if search.base.chi2_per_dof > UNEXPLAINED:
            return "unknown"
        return "explained" if findings else "none"
    if _fails(search.model, search.base):
        return "unknown"
    last = last_stage(search).finalists
    return "ambiguous" if _probabilities(last)[0] < SURE and _rivals(last) else "explained"


def _fails(model: FittedModel, base: FittedModel) -> bool:
    """Whether a part of the evidence is left unexplained, or followed by what is no explanation."""
    before = base.chi2_per_number
    shifted = np.max(np.abs(model.baseline.base.frequency_discrepancy)) > SHIFTED
    return bool(shifted) or any(
        after > LEFT and after - 1 > LEFT_SHARE * (before[part] - 1) for part, after in model.chi2_per_number.items()
    )


def last_stage(search: Search) -> Stage:
    """The stage that found the last cause of the model."""
    key = search.model.hypotheses[-1].key
    return next(s for s in reversed(search.stages) if s.accepted and s.finalists[0].hypotheses[-1].key == key)


def named_causes(search: Search, findings: list[Finding], verdict: Verdict) -> tuple[NamedCause, ...]:
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
    for hypothesis in search.model.hypotheses:
        stage = next(s for s in search.stages if s.accepted and s.finalists[0].hypotheses[-1].key == hypothesis.key)
        contenders = _contenders(stage, search.model)
        probability = _probabilities(contenders) * (0.3 if verdict == "unknown" else 1.0)
        named.append(
            _named(search.evidence, hypothesis, float(probability[0]), tuple(_rivals(contenders)), verdict != "unknown")
        )
        for rival, p in list(zip(contenders, probability, strict=True))[1:]:
            if p > 0.01:
                named.append(_named(search.evidence, rival.hypotheses[-1], float(p), (hypothesis.cause.name,), False))
    return tuple(sorted(named, key=lambda cause: (-cause.probability, -cause.in_model)))


def _contenders(stage: Stage, model: FittedModel) -> tuple[FittedModel, ...]:
    """The finalists of a stage without those whose cause a later stage took beside its best: they are no rivals."""
    taken = {hypothesis.key for hypothesis in model.hypotheses}
    return (stage.finalists[0], *(c for c in stage.finalists[1:] if c.hypotheses[-1].key not in taken))


def _named(
    evidence: MeasuredData, hypothesis: CauseHypothesis, probability: float, rivals: tuple[str, ...], in_model: bool
) -> NamedCause:  # fmt: skip
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


def close_rivals(finalists: tuple[FittedModel, ...]) -> list[FittedModel]:
    """Models with another cause than the best that explain the data nearly as well, the closest first."""
    values, best = _tempered(finalists), finalists[0]
    close = [c for c, v in zip(finalists[1:], values[1:], strict=True) if values[0] - v < RIVAL]
    return [c for c in close if _label(c) != _label(best)]


def _tempered(finalists: tuple[FittedModel, ...]) -> np.ndarray:
    """Log evidence with chi2 in units of the best model's own misfit."""
    return np.array([c.weight(finalists[0].chi2_per_dof) for c in finalists])


def _probabilities(finalists: tuple[FittedModel, ...]) -> np.ndarray:
    """Of models evenly probable beforehand."""
    values = _tempered(finalists)
    weights = np.exp(values - values.max())
    return np.asarray(np.clip(weights / weights.sum(), 0.0, 0.999))


def _rivals(finalists: tuple[FittedModel, ...]) -> list[str]:
    """Names of other causes than the first's that explain the data nearly as well."""
    return list(dict.fromkeys(_label(c) for c in close_rivals(finalists)))


def _label(fitted_model: FittedModel) -> str:
    return fitted_model.hypotheses[-1].cause.name
