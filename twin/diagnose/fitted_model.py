"""A model on trial: the base family with causes at given values, fitted together, and how probable the data make it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from twin.arrays import Array
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, WeighedProblem, modification_of
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.gauss_newton import Solution, StepRule, minimise, minimise_reweighted
from twin.identify.limits import LIMITS
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import ErrorModel
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals, LowRankWhitening


@dataclass(frozen=True, kw_only=True)
class FitOptions:
    """How far a fit goes, and what moves in it."""

    iterations: int = 12
    """Most of each Gauss-Newton search."""
    tolerance: float = 0.1
    """Of each search, see :func:`~twin.identify.gauss_newton.minimise`."""
    rounds: int = LIMITS.base_fit_reweighted
    """Most searches that follow the first one, each with the weights at the last one's end, while they gain."""
    held: tuple[int, str] | None = None
    """Number of a cause, and the name of its parameter that keeps its value."""
    frozen: bool = False
    """Whether all causes keep theirs."""
    exact: bool = False
    """Whether inferred errors below a sound rig's matter, too: not for comparing rivals, but for exact parameters."""


@dataclass(frozen=True)
class FittedModel:
    """A fitted model."""

    hypotheses: tuple[CauseHypothesis, ...]
    """The causes in it; empty for the base family."""
    baseline: BaselineParameters
    errors: ErrorModel
    """What it was allowed to be wrong by."""
    solution: Solution
    log_evidence: float
    """Laplace's approximation of the log marginal likelihood, up to a constant that all models share."""
    dof: int
    begun_anew: bool = False
    """Whether it was begun anew once, see :func:`~twin.diagnose.model_evidence.settled_fit`."""

    @property
    def name(self) -> str:
        """The causes' names, two at once as ``a + b``; ``none`` without any."""
        return " + ".join(hypothesis.cause.name for hypothesis in self.hypotheses) or "none"

    @property
    def chi2_per_dof(self) -> float:
        """Of all evidence."""
        return self.solution.chi2 / max(1, self.dof)

    def residual_model(self, evidence: MeasuredData, harmonics: HarmonicResiduals | None = None) -> ResidualModel:
        """What predicts recordings, its own or others, with its causes."""
        return ResidualModel(evidence, modification_of(evidence, self.hypotheses), harmonics)


def fit_model(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    *,
    errors: ErrorModel | None = None,
    tolerances: ResidualColumns | None = None,
    options: FitOptions = FitOptions(),
) -> FittedModel:
    """Fit the base family together with the causes' parameters, at one model error.

    Parameters
    ----------
    start, hypotheses, errors
        As for :class:`FitProblem`.
    tolerances
        What sound rigs have of every cause, which is integrated over; nothing by default.
    """
    if not options.frozen:
        shared = []
        for hypothesis in hypotheses:
            start, values = hypothesis.cause.shared(evidence, hypothesis.label, start, hypothesis.values)
            shared.append(replace(hypothesis, values=values))
        hypotheses = tuple(shared)
    problem = FitProblem(
        evidence, harmonics, start, hypotheses, errors=errors, held=options.held, frozen=options.frozen
    )
    begun = _Round(problem.weighed(np.clip(problem.x0, *problem.bounds)), tolerances, options.tolerance)
    rounds, tolerance, iterations = options.rounds, options.tolerance, options.iterations
    return fitted(problem, minimise_reweighted(begun, rounds=rounds, tolerance=tolerance, iterations=iterations))


@dataclass(frozen=True)
class _Round:
    """A search of a fit."""

    weighed: WeighedProblem
    tolerances: ResidualColumns | None
    tolerance: float

    @property
    def x(self) -> Array:
        return self.weighed.at

    def begun_at(self, x: Array) -> Self:
        return replace(self, weighed=self.weighed.problem.weighed(x))

    @cached_property
    def _white(self) -> Callable[[Array], Array]:
        held, tolerances = self.weighed.held, self.tolerances
        return LowRankWhitening.of(tolerances.whitened(held)) if tolerances else np.asarray

    def solve(self, *, iterations: int) -> Solution:
        problem, weighed, white = self.weighed.problem, self.weighed, self._white

        def evaluate(x: Array) -> tuple[Array, Array]:
            found = weighed.evaluate(x)
            return white(found.residual), white(found.jacobian)

        return minimise(
            evaluate, self.x, mean=problem.mean, precision=problem.precision, iterations=iterations,
            tolerance=self.tolerance, steps=StepRule(
                bounds=problem.bounds, largest=problem.largest_step, moved=problem.moved,
                residual_alone=lambda x: white(weighed.predict(x).residual),
            ),
        )  # fmt: skip

    def cost_at(self, there: Self) -> float:
        problem, held = self.weighed.problem, there.weighed.held.weighted_as(self.weighed.held)
        r, away = self._white(replace(there.weighed, held=held).predict(there.x).residual), there.x - problem.mean
        return float(r @ r + away @ problem.precision @ away)


def fitted(problem: FitProblem, solution: Solution) -> FittedModel:
    """The model of a problem that was solved."""
    return FittedModel(
        hypotheses=problem.hypotheses(solution.x, np.sqrt(np.diag(solution.covariance))),
        baseline=problem.baseline(solution.x),
        errors=problem.errors,
        solution=solution,
        log_evidence=float("nan"),
        dof=len(solution.residual) - solution.determined,
    )
