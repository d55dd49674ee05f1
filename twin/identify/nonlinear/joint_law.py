"""The joint's law at each point of its layer: E' - s(o), G' + j l(q), over the point's own opening o and slip q.

The papers take polynomials of one sensor's amplitude X; that holds about one resonance.  A point's own motion is what
its contact goes by, and then one pair of functions holds in every mode.  They are natural cubic splines over the
logarithm of amplitude, with s(0) = l(0) = 0: a law that saturates wants many orders of a polynomial.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline, PPoly

from twin.arrays import Array
from twin.identify.limits import LIMITS


def choose_knots(amplitude_m: Array, count: int) -> Array:
    """Knots (count,) that are evenly spaced over the logarithm of the amplitudes which matter."""
    largest = float(np.max(amplitude_m, initial=0.0)) or LIMITS.no_data_m
    return np.geomspace(LIMITS.joint_law_smallest * largest, LIMITS.last_knot * largest, count)


def spacing(knots: Array) -> float:
    """Steps of the logarithm of amplitude between knots."""
    return float(np.log(knots[-1] / knots[0])) / max(len(knots) - 1, 1)


def curve_precision(knots: Array, roughness: float) -> Array:
    """Precision (n, n) of a curve's values at its knots, over its scale.

    A Wiener process integrated twice over the logarithm of amplitude, in proportion to the amplitude as a curve is that
    begins linearly.  Its third differences are independent, and so the number of knots decides nothing.

    Parameters
    ----------
    roughness
        Standard deviation of the process over one unit of log amplitude, at the largest amplitude.
    """
    h, third = spacing(knots), np.diff(np.eye(len(knots)), 3, axis=0)
    spread = roughness * h**2.5 * knots[2:-1] / knots[-1]
    return np.asarray(third.T @ (third / spread[:, None] ** 2) + h * np.eye(len(knots)) / LIMITS.joint_law_largest**2)


@dataclass(frozen=True)
class LayerLaw:
    """Spline values at the knots: softening s of the opening and loss l of the slip, N/m2."""

    opening_knots: Array
    slip_knots: Array
    """Amplitudes > 0, m, (n,) and (m,)."""
    softening: Array
    loss: Array
    """(n,) and (m,)."""
    run_out: float = LIMITS.run_out
    """Logarithm of amplitude over which both level off beyond their last knots."""

    @staticmethod
    def zero(opening_knots: Array, slip_knots: Array) -> LayerLaw:
        """A law without nonlinearity."""
        return LayerLaw(opening_knots, slip_knots, np.zeros(len(opening_knots)), np.zeros(len(slip_knots)))

    @property
    def vector(self) -> Array:
        """Softening, then loss."""
        return np.concatenate([self.softening, self.loss])

    def softening_with_slope(self, opening_m: Array) -> tuple[Array, Array]:
        """Matrices (..., n) from :attr:`softening` to its values at openings (...), and to derivatives by their log."""
        return spline_basis(self.opening_knots, opening_m, self.run_out)

    def loss_with_slope(self, slip_m: Array) -> tuple[Array, Array]:
        """The same of the loss, (..., m)."""
        return spline_basis(self.slip_knots, slip_m, self.run_out)

    def softening_basis(self, opening_m: Array) -> Array:
        """Matrix (..., n) from :attr:`softening` to its values at openings (...)."""
        return self.softening_with_slope(opening_m)[0]

    def loss_basis(self, slip_m: Array) -> Array:
        """Matrix (..., m) from :attr:`loss` to its values at slips (...)."""
        return self.loss_with_slope(slip_m)[0]

    def softening_at(self, opening_m: Array) -> Array:
        """s, N/m2."""
        return np.asarray(self.softening_basis(np.atleast_1d(opening_m)) @ self.softening)

    def loss_at(self, slip_m: Array) -> Array:
        """l, N/m2."""
        return np.asarray(self.loss_basis(np.atleast_1d(slip_m)) @ self.loss)


def packed_laws(laws: Sequence[LayerLaw], joint: NDArray[np.int64]) -> tuple[Array, Array]:
    """Softening and loss at points of these joints for compiled code, (p, 6, i).

    Four rows of coefficients, one of breaks; then the offset.
    """
    softening = _packed([(law.opening_knots, law.softening, law.run_out) for law in laws])
    return softening[joint], _packed([(law.slip_knots, law.loss, law.run_out) for law in laws])[joint]


def _packed(curves: Sequence[tuple[Array, Array, float]]) -> Array:
    """Splines of :func:`spline_basis`; those of fewer knots than others end in intervals that nothing reaches."""
    packed = np.zeros((len(curves), 6, 3 + max((len(knots) for knots, *_ in curves), default=1)))
    for spline, (knots, values, run_out) in zip(packed, curves, strict=True):
        splines, _ = _splines(knots.tobytes(), run_out)
        pieces = len(splines.x) - 1
        spline[:4, :pieces], spline[4] = splines.c @ values, np.inf
        spline[4, : pieces + 1] = splines.x
        spline[5, 0] = knots[0] / 2
    return packed


def spline_basis(knots: Array, amplitude_m: Array, run_out: float = LIMITS.run_out) -> tuple[Array, Array]:
    """Splines that are one at one knot each, level off beyond the last, and their derivatives by log amplitude.

    Returns
    -------
    ndarray, ndarray, (..., n)
    """
    splines, slopes = _splines(knots.tobytes(), run_out)
    x, offset = np.asarray(amplitude_m, float), knots[0] / 2
    u = np.log(x + offset)
    return np.asarray(splines(u)), np.asarray(slopes(u) * (x / (x + offset))[..., None])


@lru_cache(maxsize=64)
def _splines(knots: bytes, run_out: float) -> tuple[PPoly, PPoly]:
    x = np.frombuffer(knots)
    u = np.log(np.concatenate([[0.0], x]) + x[0] / 2)
    inside = CubicSpline(u, np.vstack([np.zeros(len(x)), np.eye(len(x))]), bc_type="natural")
    value, slope = inside(u[-1]), inside(u[-1], 1)
    none = np.zeros_like(value)
    beyond = [[none, -slope / (2 * run_out), slope, value], [none, none, none, value + slope * run_out / 2]]
    coefficients = np.concatenate([inside.c, np.swapaxes(beyond, 0, 1)], axis=1)
    splines = PPoly(coefficients, np.append(u, u[-1] + [run_out, LIMITS.never]))
    return splines, splines.derivative()
