"""A smooth curve through few values, some of them shifted: polynomials with Student's noise, order by evidence."""

from dataclasses import dataclass

import numpy as np
from scipy.stats import norm
from scipy.stats import t as student

from twin.arrays import Array
from twin.identify.limits import LIMITS

UPPER_END = 0.975
"""Quantile at the upper end of a central interval of 95 %."""


@dataclass(frozen=True)
class RobustCurve:
    """A polynomial in x / x_scale."""

    coefficients: Array
    """Highest power first, (order + 1,)."""
    covariance: Array
    """(order + 1, order + 1)."""
    x_scale: float
    left_out: Array
    """Value minus the prediction by all others, (n,)."""

    @property
    def widened(self) -> float:
        """By what a deviation is larger for 1.96 of them to hold 95 %: it is itself known from few values only."""
        freedom = max(len(self.left_out) - len(self.coefficients), 1)
        return float(student.ppf(UPPER_END, freedom) / norm.ppf(UPPER_END))

    def __call__(self, x: Array | float) -> Array:
        """The curve at `x`."""
        return np.asarray(np.polyval(self.coefficients, np.asarray(x, float) / self.x_scale))

    def std(self, x: Array | float) -> Array:
        """Standard deviation of the curve itself at `x`, without the scatter of single values about it."""
        V = np.vander(np.atleast_1d(np.asarray(x, float)) / self.x_scale, len(self.coefficients))
        return np.sqrt(np.einsum("ij,jk,ik->i", V, self.covariance, V))


def fit_robust_curve(x: Array, y: Array, *, scale: float) -> RobustCurve:
    """Fit with the order whose predictions of left-out values are the most probable.

    Parameters
    ----------
    x, y : ndarray, (n,)
        At least three points.
    scale
        Scatter expected of single values, in the unit of `y`.
    """
    scores = {}
    # Once one value is left out, one more than there are coefficients must remain.
    for order in range(1 + max(0, min(4, len(x) - 3))):
        errors = left_out_errors(x, y, order=order, scale=scale)
        scores[order] = float(np.sum(student.logpdf(errors / scale, LIMITS.robust_curve_freedom)))
    order = min(n for n, score in scores.items() if score > max(scores.values()) - LIMITS.robust_curve_parsimony)
    coefficients, weight, V = _fit(x, y, order, scale)
    residual = y - V @ coefficients
    spread = np.sum(weight * residual**2) / max(len(x) - order - 1, 1)
    covariance = np.linalg.pinv((V.T * weight) @ V, hermitian=True) * max(spread, (0.3 * scale) ** 2)
    return RobustCurve(coefficients, covariance, _x_scale(x), left_out_errors(x, y, order=order, scale=scale))


def left_out_errors(x: Array, y: Array, *, order: int, scale: float) -> Array:
    """Each value minus its prediction by the curve through all others."""
    errors = np.zeros(len(x))
    powers = np.vander(x / _x_scale(x), order + 1)
    for k in range(len(x)):
        keep = np.arange(len(x)) != k
        coefficients, _, _ = _fit(x[keep], y[keep], order, scale, x_scale=_x_scale(x))
        errors[k] = y[k] - powers[k] @ coefficients
    return errors


def _fit(x: Array, y: Array, order: int, scale: float, *, x_scale: float | None = None) -> tuple[Array, Array, Array]:
    """Student regression by iterated weights: coefficients, weights, and the matrix of powers."""
    V = np.vander(x / (x_scale or _x_scale(x)), order + 1)
    freedom, weight, coefficients = LIMITS.robust_curve_freedom, np.ones(len(x)), np.full(order + 1, np.inf)
    for _ in range(100):
        root = np.sqrt(weight)
        new = np.linalg.lstsq(V * root[:, None], y * root, rcond=None)[0]
        weight = (freedom + 1) / (freedom + ((y - V @ new) / scale) ** 2)
        if np.allclose(new, coefficients, rtol=1e-10, atol=1e-12):
            break
        coefficients = new
    return new, weight, V


def _x_scale(x: Array) -> float:
    return float(np.abs(x).max())
