"""The table of a softening that acts with its harmonics: what a sine makes of it is not what the structure makes.

A softening force has a third harmonic, a tenth of the first and more, and a layer that gives way to its own force opens
at it too.  The fundamental of the force is then another by some per cent than under a pure sine of the opening.  A file
that means E'(X) as the layer acts at X therefore needs a table whose describing function differs by that much; it is
found by going round, as long as it helps: solve for the opening's harmonics at some amplitudes, compare, correct.
Some six rounds leave less than a ten-thousandth of the softening, but at the last few amplitudes.  The correction is
smooth whatever corners the functions have; were every knot corrected by itself, they would part from each other.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

__all__ = ["ORDERS", "with_own_harmonics"]

Matrix = NDArray[np.float64]
Complex = NDArray[Any]

ORDERS = (3, 5, 7)
SAMPLES = 128
AMPLITUDES = 40
TURNS, INNER_TURNS, TOLERANCE = 16, 60, 1e-5
RELAXATION = 0.6
"""Share of what is missed that a turn corrects: the whole swings where the layer has hardly any stiffness left."""


def with_own_harmonics(
    path_of: Callable[[Matrix], Callable[[Matrix], Matrix]], *, amplitude_m: Matrix, softening: Matrix,
    flexibility: Complex,
) -> Matrix:  # fmt: skip
    """The describing function to tabulate so that the layer acts with `softening` at each amplitude.

    Parameters
    ----------
    path_of
        From a softening (k,) at `amplitude_m` to the law's force along a path.
    amplitude_m, softening : ndarray, (k,)
        Amplitude of the opening's fundamental, and modulus lost there.
    flexibility : ndarray, (3,)
        Opening at ORDERS times the fundamental per unit of force, that is 1 over a modulus.
    """
    given = np.asarray(softening, float)
    if not given.any():
        return given
    meant = PchipInterpolator(amplitude_m, given)
    a = np.linspace(amplitude_m[0], amplitude_m[-1], AMPLITUDES + 1)[1:]
    correction, table, best, least = np.zeros(AMPLITUDES), given, given, np.inf
    for _ in range(TURNS):
        miss = meant(a) - _acting(path_of(table), a, meant(a), flexibility)
        missed = float(np.linalg.norm(miss))
        if not missed < least:
            break
        best, least = table, missed
        correction += RELAXATION * miss
        table = given + PchipInterpolator([amplitude_m[0], *a], [0.0, *correction])(amplitude_m)
    return best


def _acting(path: Callable[[Matrix], Matrix], a: Matrix, near: Matrix, flexibility: Complex) -> Matrix:
    """Modulus lost to the fundamental, (k,), with the opening's harmonics in balance with the force's."""
    theta = 2 * np.pi * np.arange(SAMPLES) / SAMPLES
    orders = np.array(ORDERS)
    onto, back = np.exp(-1j * np.outer(theta, orders)) * 2 / SAMPLES, np.exp(1j * np.outer(orders, theta))
    # Most of the force is linear in the opening: with that share taken implicitly, the rest is quickly in balance.
    compliance = flexibility / (1 - flexibility * near[:, None])
    sine = a[:, None] * np.cos(theta)
    o = np.zeros((len(a), len(orders)), complex)
    for _ in range(INNER_TURNS):
        opening = sine + (o @ back).real
        rest = path(opening) + near[:, None] * opening
        before, o = o, -compliance * (rest @ onto)
        if np.max(np.abs(o - before) / a[:, None]) < TOLERANCE:
            break
    force = path(sine + (o @ back).real)
    return np.asarray(-(force @ np.cos(theta)) * 2 / SAMPLES / a)
