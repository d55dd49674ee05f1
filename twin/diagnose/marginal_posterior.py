"""Marginal posterior of a cause's place: where data hardly tell it, no Gaussian about the fitted one holds."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.diagnose.cause import Parameter
from twin.diagnose.fit_problem import FitProblem
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.marginal_likelihood import MarginalLikelihood
from twin.diagnose.posterior import temperature
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.time_limit import time_is_up

_BESIDE = FitOptions(iterations=LIMITS.beside_iterations, tolerance=2.0, rounds=0)


def marginal_over_places(problem: FitProblem, tolerances: ResidualColumns | None) -> tuple[FitProblem, Array]:
    """The problem at the most probable places of its causes, and standard deviations (n,) of the unknowns about it.

    The posterior's variance, integrated over all that a sound rig may have, and the square of how far its mean is
    away.  Those of a cause with a place are taken over all its places.  The data say as little of a size as they say of
    a cause, see :func:`temperature`.

    Parameters
    ----------
    problem
        At a fit, see :attr:`FitProblem.x0`.
    """
    here = _Expansion.about(problem, tolerances)
    told: dict[int, float] = {}
    for number, (cause, parameter) in enumerate(problem.slots, problem.count):
        if parameter.is_location and not parameter.is_threshold:
            here, spread = _over_places(here, tolerances, number, cause, parameter)
            told |= {k: spread[k] for k, (i, _) in enumerate(problem.slots, problem.count) if i == cause}
    spread = np.sqrt(np.diag(here.tempered) + here.step**2)
    spread[list(told)] = list(told.values())
    return here.problem, spread


@dataclass(frozen=True)
class _Expansion:
    """Laplace's approximation of the posterior about one vector of the unknowns."""

    problem: FitProblem
    step: Array
    """To its maximum, (n,)."""
    covariance: Array
    tempered: Array
    """As the data have it, and as they count, see :func:`temperature`, (n, n)."""
    log_evidence: float

    @classmethod
    def about(cls, problem: FitProblem, tolerances: ResidualColumns | None) -> _Expansion:
        """About where a problem begins, with the errors that it has."""
        found = MarginalLikelihood(problem.weighed(), tolerances).at(problem.errors)
        count, counted = len(problem.x0), temperature(problem.evidence)
        covariance, tempered = (found.covariance(each)[:count, :count] for each in (1.0, counted))
        return cls(problem, found.step[:count], covariance, tempered, found.log_likelihood)

    def log_density(self, number: int) -> float:
        """Of one unknown's marginal posterior at the value it has here (Tierney and Kadane 1986)."""
        variance = self.covariance[number, number]
        return float(self.log_evidence - 0.5 * self.step[number] ** 2 / variance - 0.5 * np.log(2 * np.pi * variance))

    def given(self, number: int) -> tuple[Array, Array]:
        """Mean step and variances (n,) of all unknowns, given that one of them stays where it is."""
        along = self.covariance[:, number] / self.covariance[number, number]
        spread = self.tempered
        return self.step - along * self.step[number], np.diag(spread) - spread[:, number] ** 2 / spread[number, number]

    def beside(
        self, number: int, cause: int, parameter: Parameter, away: float, tolerances: ResidualColumns | None
    ) -> FitProblem | None:
        """The problem with one of the causes' place so far away and all else fitted there; None beyond its limits."""
        problem = self.problem
        lower, upper = problem.bounds
        if not lower[number] <= problem.x0[number] + away <= upper[number]:
            return None
        along = self.covariance[:, number] / self.covariance[number, number]
        x = np.clip(problem.moved(problem.x0, along * away), lower, upper)
        fit = fit_model(
            problem.evidence, problem.harmonics, problem.baseline(x), problem.hypotheses(x), errors=problem.errors,
            tolerances=tolerances, options=replace(_BESIDE, held=(cause, parameter.name)),
        )  # fmt: skip
        return FitProblem(problem.evidence, problem.harmonics, fit.baseline, fit.hypotheses, errors=problem.errors)


def _over_places(
    here: _Expansion, tolerances: ResidualColumns | None, number: int, cause: int, parameter: Parameter
) -> tuple[_Expansion, Array]:
    """The likeliest of a cause's places here and on either side, and standard deviations (n,) about it.

    Differences between places say as little as those between causes do, see :func:`temperature`.
    """
    overstated = temperature(here.problem.evidence)
    apart = (parameter.upper - parameter.lower) / parameter.scale / (2 * len(parameter.starts))
    sigma = float(np.sqrt(here.covariance[number, number]))
    step, variance = here.given(number)
    if max(sigma, abs(here.step[number])) < apart:  # no farther places are needed to tell it
        step, variance = here.step, np.diag(here.tempered)
    log_masses = [here.log_density(number) + np.log(min(apart, np.sqrt(2 * np.pi) * sigma))]
    places, means, variances = [here], [here.problem.x0 + step], [variance]
    for away in (apart, -apart):
        last = here
        while not time_is_up() and (beside := last.beside(number, cause, parameter, away, tolerances)) is not None:
            last = _Expansion.about(beside, tolerances)
            log_mass = last.log_density(number) + np.log(apart)
            if not log_mass > max(log_masses) - LIMITS.negligible_nats * overstated:
                break
            step, variance = last.given(number)
            log_masses.append(log_mass)
            places.append(last)
            means.append(beside.x0 + step)
            variances.append(variance)
    best = places[int(np.argmax(log_masses))]
    weights = np.exp((np.array(log_masses) - max(log_masses)) / overstated)
    about = np.array(variances) + (np.array(means) - best.problem.x0) ** 2
    return best, np.asarray(np.sqrt(weights @ about / weights.sum()))
