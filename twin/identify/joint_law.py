"""The joint's law as smooth functions of amplitude: E' - s(X), G' + j l(X), splines with s(0) = l(0) = 0.

The papers take polynomials for g1 = s and g2 = l; a law that saturates wants many orders of them (four leave a per
cent), so the base family is a natural cubic spline over the logarithm of amplitude, whose knots follow the data.
X is the amplitude of the reference channel scaled by (omega / omega_1)^2, which is the joint's load: a law in terms of
X alone then holds above and below resonance.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

__all__ = ["SplineLaw", "choose_knots"]

Array = NDArray[Any]


def choose_knots(amplitude_m: Array, count: int) -> Array:
    """Knots over the measured amplitudes, evenly spaced in their square root.

    The law is steepest near the largest amplitudes, where a sweep has fewest steps: knots spaced evenly in the
    logarithm, or by quantiles of the steps, leave several parts in a thousand of the response there.
    """
    if len(amplitude_m) == 0:
        return np.array([1e-4, 1e-3])
    least, most = np.min(amplitude_m), np.max(amplitude_m)
    if most < least * (1 + 1e-6):
        return least * np.array([0.9, 1.1])
    count = int(min(count, max(2, len(np.unique(amplitude_m)) // 2)))
    return np.linspace(np.sqrt(least), np.sqrt(most), count) ** 2


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
        return _basis(self.knots.tobytes(), np.asarray(X, float).tobytes())

    def softening_at(self, X: Array) -> Array:
        """s(X), N/m2."""
        return np.asarray(self.basis(np.atleast_1d(X)) @ self.softening)

    def loss_at(self, X: Array) -> Array:
        """l(X), N/m2."""
        return np.asarray(self.basis(np.atleast_1d(X)) @ self.loss)


@lru_cache(maxsize=64)
def _basis(knots: bytes, amplitudes: bytes) -> Array:
    """Of natural cubic splines over log amplitude; fits ask for the same one hundreds of times."""
    x, X = np.frombuffer(knots), np.frombuffer(amplitudes)
    offset = x[0] / 2
    u = np.log(np.concatenate([[0.0], x]) + offset)
    splines = CubicSpline(u, np.vstack([np.zeros(len(x)), np.eye(len(x))]), bc_type="natural")
    B = np.asarray(splines(np.log(np.clip(X, 0, x[-1]) + offset)))
    B.flags.writeable = False
    return B
