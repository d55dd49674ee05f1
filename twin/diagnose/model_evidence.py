"""How probable the data make a fitted model, and how wrong it must be taken to be for that.

The marginal likelihood is Laplace's: a Gaussian integral over all parameters about the fit, of the linearised residuals
with whatever covariance.  So it is known as a function of the model error without another fit, and the model error is
where it is largest, with what sound rigs need as its prior (type-II maximum likelihood).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.linalg import block_diag
from scipy.optimize import minimize, minimize_scalar

from twin.arrays import Array
from twin.diagnose.fitted_model import CauseHypothesis, FitProblem, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.gauss_newton import not_held_back
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import SOUND, Discrepancy, ErrorModel, ErrorSources, log_prior
from twin.identify.residuals.likelihood import sound_errors
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.whitening import HarmonicResiduals, Whitening

__all__ = ["Tolerances", "fit_with_errors", "infer_errors", "unexplained", "with_spread"]

GRID = (0.3, 3.0, 30.0, 300.0)
"""Errors over a sound rig's from which the likeliest are looked for."""
CLOSE = np.log(1.5)
"""Change of the logarithm of an error below which a fit need not be repeated."""
KINDS = tuple((kind, name) for kind in ("broadband", "steps") for name in ("stiffness", "ratio"))


@dataclass(frozen=True)
class _Linearised:
    """Residuals with their sensitivities, not whitened: (..., k, 1 + n), the residuals first.

    A complex number counts as two.
    """

    columns: Array

    @cached_property
    def _felt(self) -> tuple[Array, Array]:
        """Columns that are not zero, as broadband runs' are for all of the joints' laws; and which."""
        felt = np.flatnonzero(np.any(self.columns != 0, axis=tuple(range(self.columns.ndim - 1))))
        return np.ascontiguousarray(self.columns[..., felt]), felt

    def gram(self, whitening: Whitening) -> Array:
        """Their products (1 + n, 1 + n) with other covariances."""
        columns, felt = self._felt
        white = whitening.columns(columns)
        both = np.vstack([white.real, white.imag]) if np.iscomplexobj(white) else white
        found = np.zeros((self.columns.shape[-1],) * 2)
        found[np.ix_(felt, felt)] = (2 if both is not white else 1) * (both.T @ both)
        return found


@dataclass(frozen=True)
class Tolerances:
    """Directions of the residuals in which sound rigs differ from any model, each with a standard normal amount.

    No rig is exactly the nominal one: sensors, masses, dampers are a little off, and the mesh is coarse; and no rig is
    the same from sweep to sweep.  What that does to the data is known, from the causes' signatures and from the
    sensitivities to natural frequencies, and integrated over.

    Attributes
    ----------
    broadband : tuple of ndarray, (b, o, k)
    steps : ndarray, (s, 2 o, k)
        Not whitened.
    harmonics : ndarray, (s, h, o, k)
    """

    broadband: tuple[Array, ...]
    steps: Array
    harmonics: Array

    @classmethod
    def of(cls, columns: Array, blocks: tuple[tuple[str, slice], ...], held: Linearisation) -> Tolerances:
        """From whitened columns (r, k) of causes, and the shifts where these are no unknowns."""
        broadband, steps, harmonics = _unwhitened(columns, dict(blocks), held)
        if len(held.baseline.shifts):
            return cls(broadband, steps, harmonics)
        assert held.made_of is not None
        runs, sweeps = held.made_of.shifts
        return cls(
            tuple(np.dstack(pair) for pair in zip(broadband, runs, strict=True)),
            np.dstack([steps, sweeps]) if len(sweeps) else np.zeros((0, 0, steps.shape[-1] + sweeps.shape[2])),
            np.concatenate([harmonics, np.zeros((*harmonics.shape[:-1], sweeps.shape[2]))], axis=-1),
        )

    def whitened(self, blocks: tuple[tuple[str, slice], ...], held: Linearisation) -> Array:
        """The directions as columns (r, k) of a whitened residual."""
        where = dict(blocks)
        columns = np.zeros((max(part.stop for part in where.values()), self.harmonics.shape[-1]))

        def real_ones(whitening: Whitening, values: Array) -> Array:
            white = np.sqrt(2) * whitening.columns(values)
            return np.vstack([white.real, white.imag])

        for number, (whitening, run) in enumerate(zip(held.broadband, self.broadband, strict=True)):
            columns[where[f"broadband {number}"]] = real_ones(whitening, run)
        if "steps" in where:
            columns[where["steps"]] = held.steps.columns(self.steps)
        if "harmonics" in where:
            assert held.harmonics is not None
            columns[where["harmonics"]] = real_ones(held.harmonics, self.harmonics)
        return columns


def _unwhitened(rows: Array, blocks: dict[str, slice], held: Linearisation) -> tuple[tuple[Array, ...], Array, Array]:
    """Columns of rows (r, k) of a whitened residual: of broadband runs, of steps, and of harmonics."""

    def complex_ones(name: str, whitening: Whitening) -> Array:
        real, imaginary = np.split(rows[blocks[name]], 2)
        return whitening.undone((real + 1j * imaginary) / np.sqrt(2))

    broadband = tuple(complex_ones(f"broadband {number}", white) for number, white in enumerate(held.broadband))
    steps = held.steps.undone(rows[blocks["steps"]] if "steps" in blocks else rows[:0])
    if "harmonics" not in blocks:
        return broadband, steps, np.zeros((0, 0, 0, rows.shape[1]), complex)
    assert held.harmonics is not None
    return broadband, steps, complex_ones("harmonics", held.harmonics)


class _Marginal:
    """Log marginal likelihood of a model as a function of its errors, about a fit."""

    def __init__(self, problem: FitProblem, tolerances: Tolerances | None) -> None:
        x = problem.x0
        problem.weigh(x)
        residual, jacobian = problem.evaluate(x)
        assert problem.held.made_of is not None
        self._made_of: ErrorSources = problem.held.made_of
        rows = np.column_stack([residual, jacobian])
        broadband, steps, harmonics = _unwhitened(rows, dict(problem.blocks), problem.held)
        if tolerances is None:
            none = np.zeros((len(residual), 0))
            tolerances = Tolerances.of(none, problem.blocks, problem.held)
        count = tolerances.harmonics.shape[-1]
        broadband = tuple(np.dstack(pair) for pair in zip(broadband, tolerances.broadband, strict=True))
        if len(steps):
            steps = np.dstack([steps, tolerances.steps])
        harmonics = np.concatenate([harmonics, tolerances.harmonics], axis=-1)
        self._broadband, self._steps = [_Linearised(columns) for columns in broadband], _Linearised(steps)
        self._harmonics = _Linearised(harmonics)
        self._away = np.append(x - problem.mean, np.zeros(count))
        self._problem = problem
        self._precision = block_diag(problem.precision, np.eye(count))
        self._bounds = tuple(
            np.append(limit, np.full(count, side))
            for limit, side in zip(problem.bounds, (-np.inf, np.inf), strict=True)
        )
        self._x = np.append(x, np.zeros(count))
        self._known: dict[tuple[str, object], tuple[Array, float]] = {}

    def _block(self, kind: str, errors: ErrorModel) -> tuple[Array, float]:
        """Products of one kind of data, and the log determinant of its covariance."""
        key = (kind, getattr(errors, kind))
        if key not in self._known:
            gram, determinant = np.zeros((1 + len(self._away),) * 2), 0.0
            if kind == "steps" and len(self._steps.columns):
                whitening = self._made_of.of_steps(errors.steps)
                gram, determinant = self._steps.gram(whitening), whitening.log_determinant()
            elif kind == "harmonics" and len(self._harmonics.columns):
                assert self._problem.harmonics is not None
                whitening = self._problem.harmonics.whitening(errors.harmonics)
                gram, determinant = self._harmonics.gram(whitening), 2 * whitening.log_determinant()
            elif kind == "broadband":
                for block, whitening in zip(self._broadband, self._made_of.of_broadband(errors.broadband), strict=True):
                    gram, determinant = gram + block.gram(whitening), determinant + 2 * whitening.log_determinant()
            self._known[key] = gram, determinant
        return self._known[key]

    def __call__(self, errors: ErrorModel) -> float:
        kinds = ("broadband", "steps", "harmonics")
        grams, determinants = zip(*(self._block(kind, errors) for kind in kinds), strict=True)
        gram, precision = np.sum(grams, axis=0), self._precision.copy()
        more = self._problem.more_precision(errors)
        precision[: len(more), : len(more)] += more
        A = gram[1:, 1:] + precision
        pull = gram[1:, 0] - precision @ self._away
        free = not_held_back(self._x, pull, *self._bounds)
        cost = gram[0, 0] + self._away @ precision @ self._away
        cost -= pull[free] @ np.linalg.solve(A[np.ix_(free, free)], pull[free])
        volume = np.linalg.slogdet(A)[1] - np.linalg.slogdet(precision)[1]
        return float(-0.5 * (cost + volume + sum(determinants))) - self._problem.log_prior_mass


@dataclass(frozen=True)
class _Beside:
    """A fit, linearised beside what a sound rig may have of every cause.

    Attributes
    ----------
    residual, columns : ndarray, (r,) and (r, n + k)
        Whitened, with the sensitivities to the unknowns and the tolerances' directions.
    step : ndarray, (n + k,)
        From the fit and no tolerance's amount to what is most probable; nothing for an unknown that its limit holds.
    information : ndarray, (n + k, n + k)
        Inverse of the covariance of all.
    """

    problem: FitProblem
    residual: Array
    columns: Array
    step: Array
    information: Array


def _beside_tolerances(problem: FitProblem, tolerances: Tolerances) -> _Beside:
    x = problem.x0
    problem.weigh(x)
    r, J = problem.evaluate(x)
    directions = tolerances.whitened(problem.blocks, problem.held)
    count = directions.shape[1]
    both = np.hstack([J, directions])
    precision = block_diag(problem.precision, np.eye(count))
    pull = both.T @ r - precision @ np.append(x - problem.mean, np.zeros(count))
    free = np.append(not_held_back(x, pull[: len(x)], *problem.bounds), np.ones(count, bool))
    A = both.T @ both + precision
    step = np.zeros(len(pull))
    step[free] = np.linalg.solve(A[np.ix_(free, free)], pull[free])
    return _Beside(problem, r, both, step, A)


def unexplained(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, tolerances: Tolerances
) -> tuple[tuple[tuple[str, slice], ...], Array]:
    """Blocks of a residual (r,), and what it is beside all that a sound rig may have: errors, a little of every cause.

    To first order: the amounts are those that are most probable, and the unknowns follow them.
    """
    found = _beside_tolerances(FitProblem(evidence, harmonics, model.baseline, model.hypotheses), tolerances)
    return found.problem.blocks, found.residual - found.columns @ found.step


def with_spread(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, tolerances: Tolerances
) -> FittedModel:
    """The model with its causes' standard deviations: the posterior's, integrated over all that a sound rig may have.

    They are about the values that were fitted: the posterior's variance, and the square of how far its mean is away.
    """
    problem = FitProblem(evidence, harmonics, model.baseline, model.hypotheses, errors=model.errors)
    found = _beside_tolerances(problem, tolerances)
    count = len(problem.x0)
    spread = np.sqrt(np.diag(np.linalg.inv(found.information)) + found.step**2)[:count]
    return replace(model, hypotheses=problem.hypotheses(problem.x0, spread))


def infer_errors(problem: FitProblem, tolerances: Tolerances | None, *, free: bool = False) -> tuple[ErrorModel, float]:
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
    marginal, errors, usual = _Marginal(problem, tolerances), problem.errors, sound_errors(problem.evidence)

    def value(trial: ErrorModel) -> float:
        return marginal(trial) + log_prior(trial, usual, free=free)

    reached = value(errors)
    for _ in range(LIMITS.model_evidence_rounds):  # what one error leaves the others have to make up for
        if problem.harmonics is not None:
            errors = _likeliest_along(value, partial(_with_shares, errors), LIMITS.model_evidence_size)
        if len(problem.start.shifts):
            errors = _likeliest_along(value, partial(_with_shifts, errors), LIMITS.model_evidence_size)
        for curve in range(len(errors.roughness)):
            errors = _likeliest_along(value, partial(_with_roughness, errors, curve), LIMITS.model_evidence_roughness)
        for kind in ("broadband", "steps"):
            errors = _likeliest_sizes(value, errors, kind, getattr(usual, kind))
        before, reached = reached, value(errors)
        if reached - before < LIMITS.model_evidence_gain:
            break
    return errors, reached


def _likeliest_along(
    value: Callable[[ErrorModel], float], changed: Callable[[float], ErrorModel], bounds: tuple[float, float]
) -> ErrorModel:
    """The likeliest of the errors with one of them changed by a factor, whose logarithm is within bounds."""
    found = minimize_scalar(
        lambda log_size: -value(changed(log_size)), bounds=bounds, method="bounded", options={"xatol": 0.1}
    )
    return changed(found.x)


def _likeliest_sizes(
    value: Callable[[ErrorModel], float], errors: ErrorModel, kind: str, sound: Discrepancy
) -> ErrorModel:
    """The likeliest of the errors with other ones of stiffness and of ratios in one kind of data.

    They can stand for each other: two maxima, of which a climb finds either.
    """

    def cost(log_sizes: Array) -> float:
        return -value(_with_sizes(errors, kind, log_sizes))

    usual, own = np.log([sound.stiffness, sound.ratio]), getattr(errors, kind)
    grid = [usual + np.log([a, b]) for a in GRID for b in GRID]
    best = min([*grid, np.log([own.stiffness, own.ratio])], key=cost)
    found = minimize(cost, best, method="Nelder-Mead", options={"xatol": 0.2, "fatol": 0.3, "maxfev": 30})
    return _with_sizes(errors, kind, found.x)


def _with_shares(errors: ErrorModel, log_size: float) -> ErrorModel:
    return replace(errors, harmonics=float(np.exp(log_size)))


def _with_shifts(errors: ErrorModel, log_size: float) -> ErrorModel:
    return replace(errors, shifts=float(np.exp(log_size)))


def _with_roughness(errors: ErrorModel, curve: int, log_size: float) -> ErrorModel:
    roughness = list(errors.roughness)
    roughness[curve] = SOUND.roughness[curve] * float(np.exp(log_size))
    return replace(errors, roughness=(roughness[0], roughness[1]))


def _with_sizes(errors: ErrorModel, kind: str, log_sizes: Array) -> ErrorModel:
    stiffness, ratio = np.exp(log_sizes)
    sizes = Discrepancy(float(stiffness), float(ratio))
    return replace(errors, steps=sizes) if kind == "steps" else replace(errors, broadband=sizes)


def fit_with_errors(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    *,
    errors: ErrorModel | None = None,
    tolerances: Tolerances | None = None,
    tolerance: float = 0.3,
    exact: bool = False,
) -> FittedModel:
    """Fit a model and infer its error, in turn; the likeliest of these fits, with its log evidence.

    That is -inf where the residual is not finite at the start: the model cannot be there.

    Parameters
    ----------
    exact
        Whether errors below a sound rig's matter, too: not to compare rivals, but parameters that make up for each
        other are found with the errors alone that the data ask for.
    """
    errors = errors or sound_errors(evidence)
    least = 0.0 if exact else _sizes(sound_errors(evidence))
    likeliest: FittedModel | None = None
    for _ in range(LIMITS.model_evidence_refitted):
        model = fit_model(evidence, harmonics, start, hypotheses, errors=errors, tolerance=tolerance)
        if model.solution.ended == "not finite":
            return likeliest or replace(model, log_evidence=-np.inf)
        start, hypotheses = model.baseline, model.hypotheses
        problem = FitProblem(evidence, harmonics, start, hypotheses, errors=errors)
        inferred, log_evidence = infer_errors(problem, tolerances)
        model = replace(model, errors=inferred, log_evidence=log_evidence)
        if likeliest is None or not log_evidence < likeliest.log_evidence:
            likeliest = model
        if _distance(inferred, errors, least) < CLOSE:
            break
        errors = inferred
    assert likeliest is not None
    return likeliest


def _sizes(errors: ErrorModel) -> Array:
    """Those of each kind of data, of harmonics, and of shifts (6,)."""
    of_kinds = [getattr(getattr(errors, kind), name) for kind, name in KINDS]
    return np.array([*of_kinds, errors.harmonics, errors.shifts])


def _distance(one: ErrorModel, two: ErrorModel, least: Array | float) -> float:
    """Largest difference of logarithms, of errors that matter: those below `least` do not.

    Another roughness matters by the errors that it needs.
    """
    return float(np.max(np.abs(np.log(np.maximum(_sizes(one), least) / np.maximum(_sizes(two), least)))))
