"""Fits of rival models side by side, of which those that fall far behind end early (racing: Maron and Moore 1994)."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from twin.diagnose.fitted_model import CauseHypothesis, FitOptions, FittedModel, fit_model, modification_of
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import fit_with_errors
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.residual_columns import ResidualColumns
from twin.diagnose.selection.profile import highest_of_profile, threshold_of
from twin.identify.base_fit import law_from_steps
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import ErrorModel, continuation
from twin.identify.residuals.likelihood import sound_errors
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up


@dataclass(frozen=True, kw_only=True)
class Effort:
    """How much a search tries."""

    rivals: int
    """Most causes that are fitted in one turn."""
    labels: int
    """Most labels of each of them."""
    beginnings: int
    """Most places or thresholds from which each of them is begun: its likelihood may have several maxima."""
    behind: float
    """Cost over the best rival's, at one model error, from which on a fit ends early.  In seven learning cases
    (masses, slaps, sliders, stiffness, with the demonstration's seeds from 101 on) the truth's was at most 1.02;
    twice as much would do there, but not where a fit begins far from its maximum."""
    worth_a_fit: float
    """Least expected gain of log evidence over the best one's: fits gain up to four times what the first order
    promises."""
    of_needed: float = 1.0
    """The same over what a cause must gain; below zero every cause is fitted."""


USUAL = Effort(rivals=6, labels=3, beginnings=2, behind=4.0, worth_a_fit=0.2)
THOROUGH = Effort(rivals=12, labels=6, beginnings=4, behind=8.0, worth_a_fit=0.02)
WHATEVER = Effort(rivals=30, labels=30, beginnings=3, behind=np.inf, worth_a_fit=0.0, of_needed=-np.inf)
"""Of natural frequencies: a fit takes a moment, and few of them may ask for an effect that is far from first order."""


@dataclass(frozen=True)
class Begun:
    """Where a fit is, and the model errors on its way."""

    baseline: BaselineParameters
    hypotheses: tuple[CauseHypothesis, ...]
    levels: tuple[ErrorModel, ...]


@dataclass(frozen=True)
class Race:
    """Rival models of the same data."""

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None
    tolerances: ResidualColumns
    """What sound rigs have of every cause."""
    effort: Effort = USUAL
    """How much is tried."""
    on_the_way: dict[float, list[FittedModel]] = field(default_factory=dict)
    """All fits so far at each model error but the last, by the error of the steps' stiffness."""

    def run(self, begun: Sequence[Begun]) -> list[FittedModel]:
        """Fit models through smaller and smaller model errors; one that falls far behind any so far ends early.

        None are returned if the time is up before.
        """
        running = list(begun)
        for number in range(len(begun[0].levels) - 1):
            if time_is_up() or not running:
                return []
            work = [(start.baseline, start.hypotheses, start.levels[number]) for start in running]
            fits = parallel_map(_fit_at, (self.evidence, self.harmonics), work)
            both = [pair for pair in zip(fits, running, strict=True) if np.isfinite(pair[0].solution.cost)]
            both.sort(key=lambda pair: pair[0].solution.cost)
            for fit, _ in both:
                self.on_the_way.setdefault(fit.errors.steps.stiffness, []).append(fit)
            running = []
            for fit, start in both:
                least = min(other.solution.cost for other in self.on_the_way[fit.errors.steps.stiffness])
                close = fit.solution.cost <= self.effort.behind * least
                if close and not any(_same(fit.hypotheses, other.hypotheses) for other in running):
                    running.append(Begun(fit.baseline, fit.hypotheses, start.levels))
        work = [(start.baseline, start.hypotheses, start.levels[-1]) for start in running]
        last = parallel_map(partial(_fit_last, tolerances=self.tolerances), (self.evidence, self.harmonics), work)
        return [fit for each in last for fit in each if np.isfinite(fit.log_evidence)]

    def with_best_threshold(self, leading: FittedModel) -> list[FittedModel]:
        """The model whose threshold is the likeliest of all, where the last cause has one."""
        threshold = threshold_of(self.evidence, leading)
        if threshold is None or time_is_up():
            return []
        # Costs compare at one model error, and the leading fit's is of the one before.
        same = fit_model(
            self.evidence, self.harmonics, leading.baseline, leading.hypotheses, errors=leading.errors,
            tolerances=self.tolerances, options=FitOptions(tolerance=0.5, rounds=0),
        )  # fmt: skip
        found = highest_of_profile(self.evidence, self.harmonics, same, threshold, self.tolerances)
        return _fit_last(self.evidence, self.harmonics, found.baseline, found.hypotheses, found.errors, self.tolerances)


def _same(one: Sequence[CauseHypothesis], other: Sequence[CauseHypothesis]) -> bool:
    """Whether two fits, perhaps from different beginnings, have come to the same causes with the same sizes."""
    return all(
        a.key == b.key
        and all(abs(a.values[name] - b.values[name]) <= LIMITS.racing_close * std for name, std in a.std.items())
        for a, b in zip(one, other, strict=True)
    )


def _fit_at(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    errors: ErrorModel,
) -> FittedModel:
    start = _with_own_law(evidence, harmonics, start, hypotheses, errors)
    return fit_model(
        evidence, harmonics, start, hypotheses, errors=errors, options=FitOptions(iterations=8, tolerance=2.0, rounds=0)
    )


def _fit_last(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    errors: ErrorModel,
    tolerances: ResidualColumns | None,
) -> list[FittedModel]:
    """None once the time is up: what a fit still takes to end, many rivals would take after each other."""
    if time_is_up():
        return []
    start = _with_own_law(evidence, harmonics, start, hypotheses, errors)
    return [fit_with_errors(evidence, harmonics, start, hypotheses, errors=errors, tolerances=tolerances)]


def likeliest(fits: Sequence[FittedModel]) -> FittedModel:
    """The one with the largest evidence."""
    return max(fits, key=lambda fit: fit.log_evidence)


def once_more(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, fit: FittedModel, tolerances: ResidualColumns | None
) -> list[FittedModel]:
    """A model that is not as exact as sound rigs' are, through all model errors again from where it ended."""
    start, hypotheses, sound = fit.baseline, fit.hypotheses, sound_errors(evidence)
    for level in continuation(sound)[:-1]:
        loose = _fit_at(evidence, harmonics, start, hypotheses, level)
        start, hypotheses = loose.baseline, loose.hypotheses
    return _fit_last(evidence, harmonics, start, hypotheses, sound, tolerances)


def _with_own_law(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    errors: ErrorModel,
) -> BaselineParameters:
    """The start with the law that the steps ask for beside these causes, where that fits better.

    Sharp resonances make a law that was found beside another model a trap.
    """
    if not (len(evidence.steps) and evidence.joints):
        return start
    residual_model = ResidualModel(evidence, modification_of(evidence, hypotheses), harmonics, errors=errors)
    own = law_from_steps(residual_model, start.base)
    now, then = (residual_model.evaluate(trial, sensitivities=False).chi2 for trial in (start, own))
    return own if then < now else start
