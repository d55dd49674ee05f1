"""The marginal likelihood of a fitted model as a function of how wrong the model is taken to be.

It is Laplace's: a Gaussian integral over all parameters about the fit, of the linearised residuals with whatever
covariance.  So no other size of the errors needs another fit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from twin.arrays import Array
from twin.diagnose.fitted_model import WeighedProblem
from twin.diagnose.limits import LIMITS
from twin.diagnose.residual_columns import KINDS, ResidualColumns, tolerances_of
from twin.identify.cholesky import Cholesky
from twin.identify.gauss_newton import not_held_back
from twin.identify.residuals.error_model import OF_SHIFTS, ErrorModel, ErrorSources
from twin.identify.residuals.whitening import Whitening


@dataclass(frozen=True)
class AboutFit:
    """The Gaussian about a fit of n unknowns and k tolerances, with some errors."""

    log_likelihood: float
    """Marginal."""
    information: Array
    """Inverse of the covariance of the unknowns and of the tolerances' amounts, (n + k, n + k),"""
    precision: Array
    """and what of it was known before any data."""
    free: Array
    """Which of them no limit holds, (n + k,) bool."""
    step: Array
    """From the fit and no amounts to what is most probable; nothing for an unknown that its limit holds, (n + k,)."""

    def covariance(self, temperature: float = 1.0) -> Array:
        """Of all, where the data count by one over a temperature (power posterior)."""
        return Cholesky.of((self.information - self.precision) / temperature + self.precision).inverse


class MarginalLikelihood:
    """Log marginal likelihood of a model as a function of its errors, about a fit.

    Parameters
    ----------
    weighed
        At a fit.
    tolerances
        See :func:`tolerances_of`; with None the shifts alone, where these are no unknowns.

    Attributes
    ----------
    columns : ResidualColumns
        The residual, the sensitivities to n unknowns, and the k directions of the tolerances.
    """

    def __init__(self, weighed: WeighedProblem, tolerances: ResidualColumns | None) -> None:
        problem, held, x, here = weighed.problem, weighed.held, weighed.at, weighed.here
        assert held.made_of is not None
        self._made_of: ErrorSources = held.made_of
        if tolerances is None:
            tolerances = tolerances_of(np.zeros((len(here.residual), 0)), here.blocks, held)
        rows = np.column_stack([here.residual, here.jacobian])
        self.columns = ResidualColumns.of(rows, here.blocks, held).beside(tolerances)
        count = tolerances.count
        # The law is in no broadband run, and the unknowns in no harmonics: their products are nothing.
        self._felt = {kind: self.columns.felt(kind) for kind in KINDS}
        self._of_kind = {kind: self.columns.select(felt) for kind, felt in self._felt.items()}
        self._away = np.append(x - problem.mean, np.zeros(count))
        self._problem = problem
        self._precision = block_diag(problem.precision, np.eye(count))
        self._bounds = tuple(
            np.append(limit, np.full(count, side))
            for limit, side in zip(problem.bounds, (-np.inf, np.inf), strict=True)
        )
        self._x = np.append(x, np.zeros(count))
        self._known: dict[tuple[str, object], tuple[Array, float]] = {}

    def whitenings(self, kind: str, errors: ErrorModel) -> tuple[Whitening, ...]:
        """Of the residuals of one kind of data."""
        if kind == "broadband":
            return self._made_of.of_broadband(errors.broadband)
        if kind == "harmonics":
            return () if self._problem.harmonics is None else (self._problem.harmonics.whitening(errors.harmonics),)
        return (self._made_of.of_steps(errors.steps),) if len(self.columns.steps) else ()

    def _products(self, kind: str, errors: ErrorModel) -> tuple[Array, float]:
        """Products of the columns in one kind of data, and the log determinant of its covariance."""
        key = (kind, getattr(errors, kind))
        if key not in self._known:
            whitenings = self.whitenings(kind, errors)
            white = self._of_kind[kind].white(kind, whitenings)
            products, felt = np.zeros((self.columns.count, self.columns.count)), self._felt[kind]
            products[np.ix_(felt, felt)] = white.T @ white
            parts = 1 if kind == "steps" else 2
            determinant = parts * sum(whitening.log_determinant() for whitening in whitenings)
            self._known[key] = products, determinant
        return self._known[key]

    def _sums(self, errors: ErrorModel) -> tuple[Array, Array, float]:
        """Products of the columns in all data, the precision beforehand, and log determinants of both."""
        products, determinants = zip(*(self._products(kind, errors) for kind in KINDS), strict=True)
        precision, volume = self._beforehand(errors)
        return np.sum(products, axis=0), precision, sum(determinants) - volume

    def _beforehand(self, errors: ErrorModel) -> tuple[Array, float]:
        """The precision before any data, and its log determinant."""
        key = ("prior", (errors.roughness, errors.shifts))
        if key not in self._known:
            precision, own = self._precision.copy(), self._problem.precision_with(errors)
            precision[: len(own), : len(own)] = own
            self._known[key] = precision, Cholesky.of(precision).log_determinant
        return self._known[key]

    def at(self, errors: ErrorModel) -> AboutFit:
        """The likelihood, and what it is about, with these errors."""
        gram, precision, determinant = self._sums(errors)
        information = gram[1:, 1:] + precision
        pull = gram[1:, 0] - precision @ self._away
        free = not_held_back(self._x, pull, *self._bounds)
        step = np.zeros(len(pull))
        whole = Cholesky.of(information)
        own = whole if free.all() else Cholesky.of(information[np.ix_(free, free)])
        step[free] = own.solve(pull[free])
        cost = gram[0, 0] + self._away @ precision @ self._away - pull @ step
        log_likelihood = float(-0.5 * (cost + determinant + whole.log_determinant)) - self._problem.log_prior_mass
        return AboutFit(log_likelihood, information, precision, free, step)

    def with_slopes(self, errors: ErrorModel) -> tuple[float, Array]:
        """The log likelihood, and its derivatives (8,) by :attr:`ErrorModel.log_sizes`.

        What the data and the priors make of the parameters is at its largest about the step, and has no slope by it.
        """
        about, sums, sizes = self.at(errors), self._sums(errors), errors.log_sizes
        spread = Cholesky.of(about.information).inverse
        left, away = np.append(1.0, -about.step), self._away + about.step
        slopes = np.empty(len(sizes))
        for which in range(len(sizes)):
            step = LIMITS.slope_step * (np.arange(len(sizes)) == which)
            ahead, behind, apart = self._sums(errors.with_log_sizes(sizes + step)), sums, LIMITS.slope_step
            if which >= OF_SHIFTS:  # of the priors alone: both sides cost nothing
                behind, apart = self._sums(errors.with_log_sizes(sizes - step)), 2 * apart
            gram, precision, determinant = ahead[0] - behind[0], ahead[1] - behind[1], ahead[2] - behind[2]
            by_size = left @ gram @ left + away @ precision @ away + np.vdot(spread, gram[1:, 1:] + precision)
            slopes[which] = (by_size + determinant) / apart
        return about.log_likelihood, -0.5 * slopes
