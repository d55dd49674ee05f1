"""Fits of rival models side by side, of which those that fall far behind end early (racing: Maron and Moore 1994)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import fit_with_errors, likeliest, settled_fit
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.residual_columns import ResidualColumns
from twin.diagnose.selection.profile import highest, threshold_of
from twin.identify.base_fit import law_from_steps
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import ErrorModel
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
    """Most places from which each of them is begun: its likelihood may have several maxima."""
    behind: float
    """Cost over the best rival's, at one model error, from which on a fit ends early while no model follows the data:
    fits begin far from their maxima."""
    far_behind: float
    """The same once models follow the data.  In ten learning cases (the demonstration's seeds from 101 on, the second
    bench's 508 to 703, the unrelated program's) the truth's was at most 1.05, a slider's beside its neighbours."""
    worth_a_fit: float
    """Least expected gain of log evidence over the best one's: fits gain up to four times what the first order
    promises."""
    of_needed: float = 1.0
    """The same over what a cause must gain; below zero every cause is fitted."""


USUAL = Effort(rivals=6, labels=3, beginnings=2, behind=4.0, far_behind=1.5, worth_a_fit=0.2)
THOROUGH = Effort(rivals=12, labels=6, beginnings=4, behind=8.0, far_behind=3.0, worth_a_fit=0.02)
WHATEVER = Effort(
    rivals=30, labels=30, beginnings=3, behind=np.inf, far_behind=np.inf, worth_a_fit=0.0, of_needed=-np.inf
)
"""Of natural frequencies: a fit takes a moment, and few of them may ask for an effect that is far from first order."""


COARSE = FitOptions(iterations=15, tolerance=2.0, rounds=0)
"""Of fits on the way."""


@dataclass(frozen=True)
class Begun:
    """Where a fit is, and the model errors on its way."""

    baseline: BaselineParameters
    hypotheses: tuple[CauseHypothesis, ...]
    levels: tuple[ErrorModel, ...]
    """Those still ahead."""
    followed: int = 0
    """At how many before them the model followed the data."""

    @property
    def follows(self) -> bool:
        """Whether its next model error is so small that a model which needs no more follows the data."""
        return self.levels[0].steps.stiffness < LIMITS.search_follows

    def after(self, fit: FittedModel) -> Begun:
        """Where it is after that fit."""
        return Begun(fit.baseline, fit.hypotheses, self.levels[1:], self.followed + self.follows)


@dataclass(frozen=True)
class Race:
    """Rival models of the same data."""

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None
    tolerances: ResidualColumns
    """What sound rigs have of every cause."""
    effort: Effort = USUAL
    """How much is tried."""
    least: dict[float, float] = field(default_factory=dict)
    """Of the costs so far at each model error, by the error of the steps' stiffness."""

    def run(self, begun: Sequence[Begun]) -> list[FittedModel]:
        """Fit models through smaller and smaller model errors; one that falls far behind any so far ends early.

        None are returned if the time is up before.
        """
        running = list(begun)
        while left := max((len(start.levels) for start in running), default=0):
            if time_is_up():
                return []
            ahead = [start for start in running if len(start.levels) == left]
            running = [start for start in running if len(start.levels) < left]
            fits = parallel_map(_fit_at, self._given, [(start,) for start in ahead])
            both = [pair for pair in zip(fits, ahead, strict=True) if np.isfinite(pair[0].solution.cost)]
            both.sort(key=lambda pair: pair[0].solution.cost)
            error, going_on = ahead[0].levels[0].steps.stiffness, list[Begun]()
            self.least[error] = min([self.least.get(error, np.inf), *(fit.solution.cost for fit, _ in both)])
            most = self.least[error] * (self.effort.far_behind if ahead[0].follows else self.effort.behind)
            for fit, start in both:
                new = not any(_same(fit.hypotheses, other.hypotheses) for other in going_on)
                if new and fit.solution.cost <= most:
                    going_on.append(start.after(fit))
            running += going_on
        last = parallel_map(_fit_with_own_errors, self._given, [(start,) for start in running])
        fits = [fit for each in last for fit in each if np.isfinite(fit.log_evidence)]
        leading = likeliest(fits) if fits else None
        return [settled_fit(*self._given[:2], fit, self.tolerances) if fit is leading else fit for fit in fits]

    @property
    def _given(self) -> tuple[MeasuredData, HarmonicResiduals | None, ResidualColumns]:
        """What all fits have in common."""
        return self.evidence, self.harmonics, self.tolerances


def _same(one: Sequence[CauseHypothesis], other: Sequence[CauseHypothesis]) -> bool:
    """Whether two fits, perhaps from different beginnings, have come to the same causes with the same sizes."""
    return all(
        a.key == b.key
        and all(abs(a.values[name] - b.values[name]) <= LIMITS.racing_close * std for name, std in a.std.items())
        for a, b in zip(one, other, strict=True)
    )


def _fit_at(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, tolerances: ResidualColumns, begun: Begun
) -> FittedModel:
    """The fit at the next model error, with the last cause's threshold at the likeliest of some values if it has one.

    It stays at what the search begins from where the model does not yet follow the data, which then tell nothing of it.
    """
    threshold = threshold_of(evidence, begun.hypotheses[-1])
    held = None if threshold is None else (len(begun.hypotheses) - 1, threshold.name)
    fit = partial(
        fit_model, evidence, harmonics, errors=begun.levels[0], tolerances=tolerances,
        options=replace(COARSE, held=held),
    )  # fmt: skip
    found = fit(_with_own_law(evidence, harmonics, begun), begun.hypotheses)
    if threshold is None or not begun.follows:
        return found
    return highest(found, threshold, fit, halvings=begun.followed)


def _fit_with_own_errors(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, tolerances: ResidualColumns, begun: Begun
) -> list[FittedModel]:
    """None once the time is up: what a fit still takes to end, many rivals would take after each other."""
    if time_is_up():
        return []
    return [fit_with_errors(evidence, harmonics, begun.baseline, begun.hypotheses, tolerances=tolerances)]


def _with_own_law(evidence: MeasuredData, harmonics: HarmonicResiduals | None, begun: Begun) -> BaselineParameters:
    """The start with the law that the steps ask for beside these causes, where that fits better.

    Sharp resonances make a law that was found beside another model a trap.
    """
    start = begun.baseline
    if not (len(evidence.steps) and evidence.joints):
        return start
    whole = modification_of(evidence, begun.hypotheses)
    residual_model = ResidualModel(evidence, whole, harmonics, errors=begun.levels[0])
    own = law_from_steps(residual_model, start.base)
    now, then = (residual_model.evaluate(trial, sensitivities=False).chi2 for trial in (start, own))
    return own if then < now else start
