"""The joint's law as smooth functions of amplitude: E' - s(X), G' + j l(X), splines with s(0) = l(0) = 0.

The papers take polynomials for g1 = s and g2 = l; a law that saturates wants many orders of them (four leave a per
cent), so the base family is a natural cubic spline over the logarithm of amplitude, whose knots follow the data.
X is the amplitude of the reference channel scaled by (omega / omega_1)^2, which is the joint's load: a law in terms of
X alone then holds above and below resonance.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

__all__ = ["SplineLaw", "choose_knots"]

Array = NDArray[Any]


def choose_knots(amplitude_m: Array, count: int = 12) -> Array:
    """Knots over the measured amplitudes, by quantiles of their logarithm half way to equal spacing."""
    if len(amplitude_m) == 0:
        return np.array([1e-4, 1e-3])
    logs = np.log(np.sort(amplitude_m))
    count = int(min(count, max(2, len(np.unique(logs)) // 3)))
    if logs[-1] - logs[0] < 1e-6:
        return np.exp(logs[0]) * np.array([0.9, 1.1])
    even = np.linspace(logs[0], logs[-1], count)
    quantile = np.quantile(logs, np.linspace(0, 1, count))
    return np.exp((even + quantile) / 2)


@dataclass(frozen=True)
class SplineLaw:
    """Spline values at the knots: softening s and loss l, N/m2.

    Attributes
    ----------
    knots : ndarray, (n,)
        Amplitudes X > 0, m.
    softening, loss : ndarray, (n,)
    """

    knots: Array
    softening: Array
    loss: Array

    @staticmethod
    def zero(knots: Array) -> SplineLaw:
        """A law without nonlinearity."""
        return SplineLaw(knots, np.zeros(len(knots)), np.zeros(len(knots)))

    def basis(self, X: Array) -> Array:
        """Matrix (x, n) from knot values to values at X; constant beyond the last knot."""
        offset = self.knots[0] / 2
        u = np.log(np.concatenate([[0.0], self.knots]) + offset)
        splines = CubicSpline(u, np.vstack([np.zeros(len(self.knots)), np.eye(len(self.knots))]), bc_type="natural")
        return np.asarray(splines(np.log(np.clip(X, 0, self.knots[-1]) + offset)))

    def softening_at(self, X: Array) -> Array:
        """s(X), N/m2."""
        return np.asarray(self.basis(np.atleast_1d(X)) @ self.softening)

    def loss_at(self, X: Array) -> Array:
        """l(X), N/m2."""
        return np.asarray(self.basis(np.atleast_1d(X)) @ self.loss)
