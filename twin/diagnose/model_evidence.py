"""How probable the data make a fitted model, and how wrong it must be taken to be for that.

The model error is where the marginal likelihood is largest, with what sound rigs need as its prior (type-II maximum
likelihood).
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.optimize import minimize

from twin.arrays import Array
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.marginal_likelihood import MarginalLikelihood
from twin.diagnose.marginal_posterior import marginal_over_places
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import (
    OF_BROADBAND,
    OF_HARMONICS,
    OF_LOSS,
    OF_SHIFTS,
    OF_SOFTENING,
    OF_STEPS,
    ErrorModel,
    log_prior,
    log_prior_slopes,
)
from twin.identify.residuals.likelihood import sound_errors
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up

REFITTED = FitOptions(tolerance=0.3)
"""Of a fit that another follows, at the error inferred about it."""
WITHOUT = FitOptions(iterations=25, tolerance=0.3, rounds=1)
"""Of a fit without tolerances that one with them follows."""
GRID = (0.3, 3.0, 30.0, 300.0)
"""Errors over a sound rig's from which the likeliest are looked for."""
CLOSE = np.log(1.5)
"""Change of the logarithm of an error below which a fit need not be repeated."""


def unexplained(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, tolerances: ResidualColumns
) -> tuple[tuple[tuple[str, slice], ...], Array]:
    """Blocks of a residual (r,), and what it is beside all that a sound rig may have: errors, a little of every cause.

    To first order: the amounts are those that are most probable, and the unknowns follow them.
    """
    weighed = FitProblem(evidence, harmonics, model.baseline, model.hypotheses).weighed()
    marginal = MarginalLikelihood(weighed, tolerances)
    columns, step = marginal.columns.whitened(weighed.held), marginal.at(weighed.problem.errors).step
    return weighed.here.blocks, columns[:, 0] - columns[:, 1:] @ step


def with_spread(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, tolerances: ResidualColumns
) -> FittedModel:
    """The model at its causes' most probable places, with their deviations, see :func:`marginal_over_places`."""
    problem = FitProblem(evidence, harmonics, model.baseline, model.hypotheses, errors=model.errors)
    problem, spread = marginal_over_places(problem, tolerances)
    return replace(model, baseline=problem.start, hypotheses=problem.hypotheses(problem.x0, spread))


def infer_errors(
    problem: FitProblem, tolerances: ResidualColumns | None, *, free: bool = False
) -> tuple[ErrorModel, float]:
    """The likeliest model error about a fit, and the model's log evidence with it.

    Parameters
    ----------
    problem
        At a fit, see :attr:`FitProblem.x0`.
    tolerances
        What sound rigs have of every cause; with None the shifts alone, where these are no unknowns.
    free
        Whether the errors of stiffness may have any size: what a model deserves that lacks something.
    """
    marginal = MarginalLikelihood(problem.weighed(), tolerances)
    errors, usual = problem.errors, sound_errors(problem.evidence)
    here, middle = errors.log_sizes, usual.log_sizes

    def cost(sizes: Array) -> float:
        trial = errors.with_log_sizes(sizes)
        return -marginal.at(trial).log_likelihood - log_prior(trial, usual, free=free)

    def with_slopes(sizes: Array) -> tuple[float, Array]:
        trial = errors.with_log_sizes(sizes)
        log_likelihood, slopes = marginal.with_slopes(trial)
        return -log_likelihood - log_prior(trial, usual, free=free), -slopes - log_prior_slopes(trial, usual, free=free)

    bounds = middle[:, None] + np.array(LIMITS.model_evidence_any)
    bounds[OF_HARMONICS:] = here[OF_HARMONICS:, None]
    for which, limits in (
        (OF_HARMONICS, LIMITS.model_evidence_size if problem.harmonics is not None else None),
        (OF_SHIFTS, LIMITS.model_evidence_shifts if len(problem.start.shifts) else None),
        (OF_SOFTENING, LIMITS.model_evidence_roughness),
        (OF_LOSS, LIMITS.model_evidence_roughness),
    ):
        if limits is not None:
            bounds[which] = middle[which] + np.array(limits)
    sizes = min((np.clip(start, *bounds.T) for start in (middle, here)), key=cost)
    for pair in (OF_BROADBAND, OF_STEPS):  # they can stand for each other: two maxima
        grid = [_with(sizes, pair, middle[pair] + np.log([a, b])) for a in GRID for b in GRID]
        sizes = min((sizes, *grid), key=cost)
    close = {"ftol": LIMITS.model_evidence_close}
    likeliest = minimize(with_slopes, sizes, jac=True, bounds=bounds, method="L-BFGS-B", options=close)
    return errors.with_log_sizes(likeliest.x), -float(likeliest.fun)


def _with(sizes: Array, where: slice, others: Array) -> Array:
    """The vector with other elements in one place."""
    changed = sizes.copy()
    changed[where] = others
    return changed


def fit_with_errors(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    *,
    errors: ErrorModel | None = None,
    tolerances: ResidualColumns | None = None,
    options: FitOptions = REFITTED,
) -> FittedModel:
    """Fit a model and infer its error, in turn; the likeliest of these fits, with its log evidence.

    That is -inf where the residual is not finite at the start: the model cannot be there.
    """
    errors = errors or sound_errors(evidence)
    least = -np.inf if options.exact else sound_errors(evidence).log_sizes[:OF_SOFTENING]
    likeliest: FittedModel | None = None
    for _ in range(LIMITS.model_evidence_refitted):
        model = fit_model(evidence, harmonics, start, hypotheses, errors=errors, tolerances=tolerances, options=options)
        if model.solution.ended == "not finite":
            return likeliest or replace(model, log_evidence=-np.inf)
        start, hypotheses = model.baseline, model.hypotheses
        problem = FitProblem(evidence, harmonics, start, hypotheses, errors=errors)
        inferred, log_evidence = infer_errors(problem, tolerances)
        model = replace(model, errors=inferred, log_evidence=log_evidence)
        if likeliest is not None and not log_evidence > likeliest.log_evidence:
            break  # errors may have two maxima, each of which leads to the other
        likeliest = model
        if _distance(inferred, errors, least, settled=model.solution.settled) < CLOSE or time_is_up():
            break
        errors = inferred
    assert likeliest is not None
    return likeliest


def _distance(one: ErrorModel, two: ErrorModel, least: Array | float, *, settled: bool) -> float:
    """Largest difference of logarithms, of errors that matter: those below `least` do not.

    Another roughness matters by the errors that it needs; or in itself, where a fit with the one did not settle.
    """
    sizes = [np.maximum(errors.log_sizes[:OF_SOFTENING], least) for errors in (one, two)]
    rougher = 0.0 if settled else np.max(np.abs(one.log_sizes - two.log_sizes)[OF_SOFTENING:])
    return float(max(np.max(np.abs(sizes[0] - sizes[1])), rougher))


def settled_fit(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    fit: FittedModel,
    tolerances: ResidualColumns,
    *,
    options: FitOptions = REFITTED,
) -> FittedModel:
    """A fit of causes beside tolerances; if it did not settle, the likelier of it and one that is begun without these.

    Tolerances make up for much of the parameters: in the wide and bent valley between them steps are tiny, and a fit
    runs out of iterations on the way.  What was begun anew once, and does not settle, would come to the same again.
    """
    if fit.solution.settled or fit.begun_anew or time_is_up():
        return fit
    alone = fit_model(evidence, harmonics, fit.baseline, fit.hypotheses, errors=fit.errors, options=WITHOUT)
    anew = fit_with_errors(
        evidence, harmonics, alone.baseline, alone.hypotheses, errors=fit.errors, tolerances=tolerances, options=options
    )
    return replace(likeliest((fit, anew)), begun_anew=True)


def likeliest(fits: Sequence[FittedModel]) -> FittedModel:
    """The one with the largest evidence."""
    return max(fits, key=lambda fit: fit.log_evidence)
