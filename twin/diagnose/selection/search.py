"""Stepwise selection: causes are added one by one, and dropped again, while the posterior odds gain by it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from twin.diagnose.cause import Cause, strengths_of
from twin.diagnose.fit_problem import FitProblem, modification_of
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import REFITTED, fit_with_errors, infer_errors, likeliest, settled_fit, with_spread
from twin.diagnose.posterior import log_weight
from twin.diagnose.residual_columns import ResidualColumns
from twin.diagnose.selection.racing import USUAL, Effort, Race
from twin.diagnose.selection.rivals import Report, fitted_rivals
from twin.diagnose.selection.score_test import Score, score_causes
from twin.identify.base_fit import fit_base
from twin.identify.frequency_shifts import SHIFT
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import continuation
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.likelihood import sound_errors
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up


@dataclass(frozen=True)
class Stage:
    """One turn of the selection."""

    before: FittedModel
    """The model without a further cause; where one is dropped, with it."""
    scores: tuple[Score, ...]
    """Best first."""
    rivals: tuple[FittedModel, ...]
    """The models with one more cause, or one less, that were fitted, most probable first."""
    accepted: bool
    """Whether the first of them is more probable than the model without."""
    unknown: float
    """Log evidence of the more probable of both with errors of any size."""
    tolerances: ResidualColumns
    """What a sound rig may have of every cause."""
    complete: bool = True
    """Whether the time allowed for all of it; nothing is accepted otherwise."""

    @property
    def best(self) -> FittedModel:
        """The model that the next stage goes on from, or the last one."""
        return self.rivals[0] if self.accepted else self.before


@dataclass(frozen=True)
class Search:
    """Outcome of a selection."""

    base: FittedModel
    """The base family alone."""
    model: FittedModel
    """The base family with the causes that were selected."""
    stages: tuple[Stage, ...]
    """The last one found no further cause."""
    evidence: MeasuredData
    """The recordings, as they were reduced against what was found."""
    harmonics: HarmonicResiduals | None
    """Of the steps, with `model`,"""
    base_harmonics: HarmonicResiduals | None
    """and with `base`."""

    @property
    def complete(self) -> bool:
        """Whether the time allowed for all of it."""
        return self.stages[-1].complete


@np.errstate(all="ignore")  # a rival that is not finite somewhere is out, and no news
def search_causes(
    evidence: MeasuredData,
    causes: Mapping[str, Cause],
    *,
    most: int = 3,
    effort: Effort = USUAL,
    report: Report = lambda text: None,
) -> Search:
    """Select up to `most` causes, as far as the time allows.

    Parameters
    ----------
    causes
        What may be named.
    effort
        How much is tried for each.
    report
        Told what is being done.
    """
    report("fitting moduli, damping and the joint's law")
    start = fit_base(evidence)
    exact = replace(REFITTED, exact=True)
    base = fit_with_errors(evidence, None, start.baseline, (), errors=start.errors, options=exact)
    base_harmonics = _harmonics(evidence, base)
    data, model = _Reduced(evidence, base_harmonics), base
    stages: list[Stage] = []
    while not stages or stages[-1].accepted:
        # What was dropped may come again, and be dropped again: the last turn only weighs what there is.
        stages.append(_one_more(data, model, causes, most if len(stages) < 2 * most else 0, effort, report))
        model = stages[-1].best
        if stages[-1].accepted:
            data = _reduced_anew(data, model)
            if (simpler := _one_less(data, model, causes, stages[-1], report)) is not None:
                stages.append(simpler)
                model = simpler.best
                data = _reduced_anew(data, model)
    if model.hypotheses:  # at the maximum of its own posterior: rivals were compared before that
        model = _refitted(data, model, stages[-1].tolerances, exact=True)
    model = with_spread(*data, model, stages[-1].tolerances)
    predicts = _refitted(data, model, exact=True, frozen=True) if model.hypotheses else base
    model = replace(model, baseline=predicts.baseline)  # predictions have no tolerances
    return Search(base, model, tuple(stages), *data, base_harmonics)


class _Reduced(NamedTuple):
    """The recordings as they were last reduced."""

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None


def _one_more(
    data: _Reduced, model: FittedModel, causes: Mapping[str, Cause], most: int, effort: Effort, report: Report
) -> Stage:
    """Forward: the model against those with one more cause."""
    evidence, harmonics = data
    report("scoring causes" if not model.hypotheses else f"scoring causes beside {model.name}")
    begin, follows = _following(evidence, harmonics, model), _follows(model)
    left = {} if time_is_up() else _beside(model, causes)
    # With a cause it was fitted beside what sound rigs have before.
    anew = follows and not model.hypotheses
    scores, tolerances, begin = score_causes(evidence, harmonics, begin, left, errors=model.errors, refitted=anew)
    before = begin if anew else (_refitted if follows else _as_it_is)(data, model, tolerances)
    rivals: tuple[FittedModel, ...] = ()
    if len(model.hypotheses) < most:
        race = Race(evidence, harmonics, tolerances, effort)
        rivals = fitted_rivals(race, begin, before, scores, partial(_scores_if_sound, data, model, left), report)
    if not (follows or time_is_up() or any(map(_follows, rivals))):  # else it is too far behind to matter
        before = _refitted(data, model, tolerances)
    if _lead(evidence, rivals, before) and (
        _gained_by_the_last(evidence, rivals[0]) < rivals[0].log_evidence - before.log_evidence
    ):
        before = likeliest((before, _without_the_last(data, rivals[0], tolerances)))
    complete = not time_is_up()
    accepted = complete and _lead(evidence, rivals, before)
    best = rivals[0] if accepted else before
    told = log_weight(evidence, best) + float(np.log(LIMITS.worth_a_line))
    rivals = tuple(
        # What is accepted is told as it is fitted last.
        with_spread(evidence, harmonics, rival, tolerances)
        if rival is not best and log_weight(evidence, rival) > told
        else rival
        for rival in rivals
    )
    unknown = _with_any_error(data, best, tolerances)
    return Stage(before, tuple(scores), rivals, accepted, unknown, tolerances, complete)


def _lead(evidence: MeasuredData, rivals: Sequence[FittedModel], before: FittedModel) -> bool:
    """Whether the first of the rivals is more probable than the model without a further cause."""
    return len(rivals) > 0 and log_weight(evidence, rivals[0]) > log_weight(evidence, before)


def _gained_by_the_last(evidence: MeasuredData, model: FittedModel) -> float:
    """Nats that the last cause explains where the model ended, by the strength that is surest (Wald's test)."""
    last = model.hypotheses[-1]
    strengths = strengths_of(last.cause.parameters(evidence, last.label))
    fitted = [p for p in strengths if not p.is_known]
    return max(((last.values[p.name] - p.null) ** 2 / last.std[p.name] ** 2 / 2 for p in fitted), default=np.inf)


def _without_the_last(data: _Reduced, whole: FittedModel, tolerances: ResidualColumns) -> FittedModel:
    """The model without its last cause, fitted from where it ended with it.

    A cause gains by what it explains, not by a better minimum of all else that its fit came to.
    """
    return _refitted(data, replace(whole, hypotheses=whole.hypotheses[:-1], begun_anew=False), tolerances)


def _one_less(
    data: _Reduced, model: FittedModel, causes: Mapping[str, Cause], chosen: Stage, report: Report
) -> Stage | None:
    """Backward: the likeliest model without one of the causes named before the last, if it is likelier than with it.

    What was named first may have stood for what was found after it.  The last one's rivals stay as far behind as they
    were.
    """
    evidence, harmonics = data
    found: list[tuple[FittedModel, FittedModel, list[Score], ResidualColumns]] = []
    for earlier in model.hypotheses[:-1]:
        if time_is_up():
            return None
        report(f"fitting without {earlier.key}")
        others = tuple(hypothesis for hypothesis in model.hypotheses if hypothesis is not earlier)
        simpler = fit_with_errors(evidence, harmonics, model.baseline, others)
        scores, tolerances, simpler = score_causes(
            evidence, harmonics, simpler, _beside(simpler, causes), refitted=True
        )
        whole = _refitted(data, model, tolerances)
        if log_weight(evidence, simpler) > log_weight(evidence, whole):
            found.append((simpler, whole, scores, tolerances))
    if not found:
        return None
    simpler, whole, scores, tolerances = max(found, key=lambda each: log_weight(evidence, each[0]))
    shift = whole.log_evidence - chosen.best.log_evidence
    rivals = tuple(replace(rival, log_evidence=rival.log_evidence + shift) for rival in chosen.rivals[1:])
    unknown = _with_any_error(data, simpler, tolerances)
    return Stage(whole, tuple(scores), (simpler, *rivals), True, unknown, tolerances)


def _beside(model: FittedModel, causes: Mapping[str, Cause]) -> dict[str, Cause]:
    """Causes that the model does not have yet."""
    named = {hypothesis.cause.name for hypothesis in model.hypotheses}
    return {name: cause for name, cause in causes.items() if name not in named}


def _reduced_anew(data: _Reduced, best: FittedModel) -> _Reduced:
    """Harmonics less what the best model makes of the force's own: those less one's far off have its errors in them."""
    return data._replace(harmonics=None if data.harmonics is None else _harmonics(data.evidence, best))


def _with_any_error(data: _Reduced, model: FittedModel, tolerances: ResidualColumns) -> float:
    """Log evidence of the model with errors of any size."""
    return _as_it_is(data, model, tolerances, free=True).log_evidence


def _as_it_is(data: _Reduced, model: FittedModel, tolerances: ResidualColumns, *, free: bool = False) -> FittedModel:
    """The model with its likeliest errors and log evidence beside what sound rigs have, without a fit."""
    problem = FitProblem(*data, model.baseline, model.hypotheses, errors=model.errors)
    errors, log_evidence = infer_errors(problem, tolerances, free=free)
    return replace(model, errors=errors, log_evidence=log_evidence)


def _follows(model: FittedModel) -> bool:
    """Whether its resonances are where those of the data are."""
    return max(model.errors.steps.stiffness, model.errors.broadband.stiffness) < LIMITS.search_follows


def _following(evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel) -> FittedModel:
    """The model as causes are scored: where it does not follow the data, each run with natural frequencies of its own.

    These say best where the resonances are, and a cause explains what they should not need.
    """
    if _follows(model):
        return model
    start, hypotheses = model.baseline, model.hypotheses
    loose = continuation(sound_errors(evidence))[0]
    loose = replace(loose, shifts=loose.frequency / SHIFT)
    for _ in range(2):
        fit = fit_model(
            evidence, harmonics, start, hypotheses, errors=loose, options=FitOptions(iterations=15, tolerance=2.0)
        )
        start, hypotheses = fit.baseline, fit.hypotheses
    return fit


def _scores_if_sound(data: _Reduced, model: FittedModel, causes: Mapping[str, Cause]) -> list[Score]:
    """First orders about the model as it is fitted where it may err no more than a sound rig's."""
    fit = fit_model(*data, model.baseline, model.hypotheses, options=FitOptions(tolerance=2.0))
    return score_causes(*data, fit, causes)[0]


def _refitted(
    data: _Reduced, model: FittedModel, tolerances: ResidualColumns | None = None, **options: Any
) -> FittedModel:
    """The model with its log evidence, fitted beside what sound rigs have of every cause, or with no tolerances."""
    chosen = replace(REFITTED, **options)
    fit = fit_with_errors(
        *data, model.baseline, model.hypotheses, errors=model.errors, tolerances=tolerances, options=chosen
    )
    fit = replace(fit, begun_anew=model.begun_anew)
    return settled_fit(*data, fit, tolerances, options=chosen) if tolerances and fit.hypotheses else fit


def _harmonics(evidence: MeasuredData, model: FittedModel) -> HarmonicResiduals | None:
    """Harmonics of the steps less the linear response to the force's own, with the model found so far."""
    if not len(evidence.steps):
        return None
    modification = modification_of(evidence, model.hypotheses)
    # What local nonlinear forces add is the prediction's matter.
    return harmonic_residuals(ResidualModel(evidence, replace(modification, nonlinear=())), model.baseline)
