"""The marginal likelihood of a fitted model as a function of how wrong the model is taken to be.

It is Laplace's: a Gaussian integral over all parameters about the fit, of the linearised residuals with whatever
covariance.  So no other size of the errors needs another fit.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import block_diag

from twin.arrays import Array
from twin.diagnose.fit_problem import WeighedProblem
from twin.diagnose.residual_columns import KINDS, ResidualColumns, tolerances_of
from twin.identify.cholesky import Cholesky
from twin.identify.gauss_newton import not_held_back
from twin.identify.residuals.error_model import (
    OF_BROADBAND,
    OF_HARMONICS,
    OF_SHIFTS,
    OF_STEPS,
    ErrorModel,
    ErrorSources,
)
from twin.identify.residuals.whitening import CovarianceTerms, Whitening, real_ones

OF_KINDS = dict(zip(KINDS, (OF_BROADBAND, OF_STEPS, slice(OF_HARMONICS, OF_SHIFTS)), strict=True))
"""Which of :attr:`ErrorModel.log_sizes` each kind of data has."""


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
        self._problem = problem
        if tolerances is None:
            tolerances = tolerances_of(np.zeros((len(here.residual), 0)), here.blocks, held)
        rows = np.column_stack([here.residual, here.jacobian])
        self.columns = ResidualColumns.of(rows, here.blocks, held).beside(tolerances)
        count = tolerances.count
        # The law is in no broadband run, and the unknowns in no harmonics: their products are nothing.
        self._felt = {kind: self.columns.felt(kind) for kind in KINDS}
        self._real = {kind: self._real_of(kind) for kind in KINDS}
        self._away = np.append(x - problem.mean, np.zeros(count))
        self._precision = block_diag(problem.precision, np.eye(count))
        self._bounds = tuple(
            np.append(limit, np.full(count, side))
            for limit, side in zip(problem.bounds, (-np.inf, np.inf), strict=True)
        )
        self._x = np.append(x, np.zeros(count))
        self._known: dict[tuple[str, object], tuple[Array, float]] = {}
        self._last: dict[str, tuple[object, list[tuple[Whitening, Array]]]] = {}

    def _real_of(self, kind: str) -> list[tuple[CovarianceTerms, Array]]:
        """What covariances are made of, and columns (..., k, c) that are felt, in one kind of data and real numbers."""
        columns = self.columns.select(self._felt[kind]).of_kind(kind)
        return [
            (terms.of_real_ones, real_ones(values, axis=-2)) if np.iscomplexobj(values) else (terms, values)
            for terms, values in zip(self._terms(kind), columns, strict=False)
        ]

    def _terms(self, kind: str) -> tuple[CovarianceTerms, ...]:
        """What the covariances of the residuals of one kind of data are made of."""
        if kind == "broadband":
            return self._made_of.terms_of_broadband
        if kind == "harmonics":
            return self._made_of.terms_of_harmonics
        return (self._made_of.terms_of_steps,) if len(self.columns.steps) else ()

    def whitenings(self, kind: str, errors: ErrorModel) -> tuple[Whitening, ...]:
        """Of the residuals of one kind of data."""
        sizes = np.exp(errors.log_sizes[OF_KINDS[kind]])
        return tuple(terms.whitening(*sizes) for terms in self._terms(kind))

    def _white(self, kind: str, errors: ErrorModel) -> list[tuple[Whitening, Array]]:
        """What whitens one kind of data, and columns that it has whitened; kept for the slopes, which come next."""
        key = getattr(errors, kind)
        if self._last.get(kind, (None,))[0] != key:
            sizes = np.exp(errors.log_sizes[OF_KINDS[kind]])
            whitenings = [(terms.whitening(*sizes), columns) for terms, columns in self._real[kind]]
            self._last[kind] = key, [(each, each.inverse @ columns) for each, columns in whitenings]
        return self._last[kind][1]

    def _products(self, kind: str, errors: ErrorModel) -> tuple[Array, float]:
        """Products of the columns in one kind of data, and the log determinant of its covariance."""
        key = (kind, getattr(errors, kind))
        if key not in self._known:
            products, felt = np.zeros((self.columns.count, self.columns.count)), self._felt[kind]
            white = self._white(kind, errors)
            for _, columns in white:
                rows = columns.reshape(-1, len(felt))
                products[np.ix_(felt, felt)] += rows.T @ rows
            self._known[key] = products, sum(whitening.log_determinant() for whitening, _ in white)
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
        So products of the columns count by their own weights, those of the parameters' deviations by theirs.
        """
        about = self.at(errors)
        spread, left = Cholesky.of(about.information).inverse, np.append(1.0, -about.step)
        away, weights = self._away + about.step, np.outer(left, left)
        weights[1:, 1:] += spread
        slopes = np.zeros(len(errors.log_sizes))
        for kind, where in OF_KINDS.items():
            slopes[where] = self._slopes_by_data(kind, errors, weights)
        n, sizes = self._problem.count, np.exp(errors.log_sizes[OF_SHIFTS:])
        beyond = (np.outer(away, away) + spread)[:n, :n] - Cholesky.of(about.precision[:n, :n]).inverse
        slopes[OF_SHIFTS:] = [np.vdot(beyond, term) for term in self._problem.precision_terms] * (-2 / sizes**2)
        return about.log_likelihood, -0.5 * slopes

    def _slopes_by_data(self, kind: str, errors: ErrorModel, weights: Array) -> Array:
        """Derivatives of weighted products of the columns, and of the covariances' log determinant, by their sizes."""
        where, felt = OF_KINDS[kind], self._felt[kind]
        sizes, own = np.exp(errors.log_sizes[where]), weights[np.ix_(felt, felt)]
        slopes = np.zeros(len(sizes))
        for (terms, _), (whitening, white) in zip(self._real[kind], self._white(kind, errors), strict=True):
            weighted = (white.reshape(-1, len(felt)) @ own).reshape(white.shape)
            beyond = np.eye(white.shape[-2]) - weighted @ np.swapaxes(white, -2, -1)
            by_covariance = np.swapaxes(whitening.inverse, -2, -1) @ beyond @ whitening.inverse
            slopes += [np.vdot(slope, by_covariance) for slope in terms.slopes(*sizes)]
        return slopes
