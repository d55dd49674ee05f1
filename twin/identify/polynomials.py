"""The papers' polynomials of one sensor's amplitude, as they were identified beside the joint's own law.

How they are identified is :mod:`studies.force_levels`' matter.
"""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.l_curve import LCurve
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearParameters


@dataclass(frozen=True)
class Iteration:
    """The residual's norm, the coefficients in SI units, and the strength that led there (0 at the start)."""

    cost: float
    softening: Array
    loss: Array
    strength: float


@dataclass(frozen=True, kw_only=True)
class PolynomialFit:
    """Identified polynomials."""

    softening: Array
    loss: Array
    """Coefficients of g1 and g2, constant first: N/m2, N/m3, ..."""
    covariance: Array
    """Of both together: from the scatter that the fit leaves, and from the base parameters' own covariance."""
    base_change: Array
    """What the steps make of the base parameters, within that covariance."""
    variance: float
    """Scatter of the residuals, real and imaginary parts of the logarithm."""
    bic: float
    """Schwarz's criterion, lower is better, comparable among fits to the same steps."""
    largest_amplitude_m: float
    """The polynomials hold up to here."""
    residual_percent: float
    """Root-mean-square relative error of the complex response of the reference channel."""
    l_curve: LCurve
    """Of the first iteration, in units of the scaled coefficients."""
    history: tuple[Iteration, ...]

    @property
    def orders(self) -> tuple[int, int]:
        """Of g1 and g2."""
        return len(self.softening) - 1, len(self.loss) - 1

    @property
    def std(self) -> tuple[Array, Array]:
        """Standard deviations of the coefficients of g1 and g2."""
        std = np.sqrt(np.diag(self.covariance))
        return std[: len(self.softening)], std[len(self.softening) :]

    def softening_at(self, X: Array) -> Array:
        """g1(X), N/m2."""
        return np.polynomial.polynomial.polyval(np.asarray(X, float), self.softening)

    def loss_at(self, X: Array) -> Array:
        """g2(X), N/m2."""
        return np.polynomial.polynomial.polyval(np.asarray(X, float), self.loss)


@dataclass(frozen=True, kw_only=True)
class LeftOut:
    """A level predicted by the law of all others; rms relative errors of the complex response, per cent."""

    at_amplitude_percent: float
    """With the moduli at each step's measured amplitude, as in the fits."""
    at_force_percent: float
    """With nothing but each step's frequency and force given: the steady state on the measured one's branch."""
    lost: int
    """Steps for which that branch does not exist in the prediction; they count in the first figure only."""
    extrapolated: bool
    """Whether the level reaches amplitudes beyond all others."""


@dataclass(frozen=True, kw_only=True)
class Polynomials:
    """The papers' identification: each excitation level by itself, as they do, and all together, as they do not."""

    levels: dict[str, PolynomialFit]
    """By target channel and amplitude."""
    together: PolynomialFit
    residual_percent: dict[str, dict[str, float]]
    """By sweep: the residuals of its level's own polynomials, and of the common ones."""
    left_out: dict[str, LeftOut]
    """By level, where there are at least two; see :func:`studies.force_levels.predict_left_out`."""
    base: LinearParameters
    """Linear parameters that all are counted from; `base_change` of a fit is what its steps add to them."""

    @property
    def depends_on_force(self) -> bool | None:
        """Whether one law for all levels leaves too much, and twice what a law for each leaves; None for one level."""
        if len(self.levels) < 2:
            return None
        each = float(np.sqrt(np.mean([fit.residual_percent**2 for fit in self.levels.values()])))
        return self.together.residual_percent > max(LIMITS.poor_polynomial_percent, 2 * each)
