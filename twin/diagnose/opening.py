"""Even harmonics of a joint that loses contact where it opens, beside whatever softening it has."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

__all__ = ["odd_force", "opening_harmonics"]

Array = NDArray[Any]

KNOTS, GRID, SAMPLES = 14, 160, 128
NODES, WEIGHTS = np.polynomial.legendre.leggauss(40)


def odd_force(amplitude: Array, secant: Array) -> tuple[Array, Array]:
    """The odd force whose describing function is known at some amplitudes.

    The inverse of f -> N(a) = 2 / (pi a) int_0^pi f(a cos t) cos t dt is Abel's; with u = sin t it reads
    f(x) = x / 2 int_0^(pi/2) (3 sin^3 t N(x sin t) + x sin^4 t N'(x sin t)) dt.

    Parameters
    ----------
    amplitude : ndarray, (s,)
    secant : ndarray, (s,)
        N, in units of the linear stiffness; scatter is smoothed.

    Returns
    -------
    x, force : ndarray
        On a grid from zero to the largest amplitude.
    """
    order = np.argsort(amplitude)
    groups = np.array_split(order, min(KNOTS, max(2, len(order) // 3)))
    a = np.array([np.mean(amplitude[group]) for group in groups if len(group)])
    N = np.array([np.median(secant[group]) for group in groups if len(group)])
    a, first = np.unique(a, return_index=True)
    N = N[first]
    most = float(np.max(amplitude))
    if most > a[-1]:
        # A group's mean lies below its largest amplitude, and the curve has to reach that.
        a, N = np.append(a, most), np.append(N, secant[np.argmax(amplitude)])
    curve = PchipInterpolator(np.append(0.0, a), np.append(N[0], N))
    slope = curve.derivative()
    x = np.linspace(0.0, a[-1], GRID)
    sine = np.sin((NODES + 1) * np.pi / 4)
    A = np.minimum(x[:, None] * sine, a[-1])
    integrand = 3 * sine**3 * curve(A) + x[:, None] * sine**4 * slope(A)
    return x, x / 2 * (integrand @ WEIGHTS) * np.pi / 4


def opening_harmonics(amplitude: Array, secant: Array, *, gap: float, factor: float, count: int) -> Array:
    """Harmonics 1 ... count of the even part of the force, for motion a cos t about the mean that it makes itself.

    A joint whose force beyond the gap goes on with `factor` of its slope has an odd part f, which is what the
    fundamental shows, and the even part (factor - 1) / (factor + 1) (f(|x|) - f(gap)) beyond the gap.  Since nothing
    outboard of the joint holds it, its mean force is zero: the mean opening follows from that.

    Parameters
    ----------
    amplitude : ndarray, (s,)
        Of the opening, m.
    secant : ndarray, (s,)
        Describing function of the whole joint at these amplitudes, in units of its linear stiffness.

    Returns
    -------
    ndarray, (s, count)
        In units of the linear stiffness times metres; the odd ones are zero.
    """
    x, f = odd_force(amplitude, secant)
    share = (factor - 1) / (factor + 1)
    slope = np.gradient(f, x)
    cosine = np.cos(2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES)
    at_gap = np.interp(gap, x, f)
    mean = np.zeros(len(amplitude))

    def force(opening: Array) -> Array:
        size = np.abs(opening)
        # Beyond the table the force goes on along its last slope.
        odd = np.interp(size, x, f) + np.maximum(size - x[-1], 0.0) * slope[-1]
        return np.asarray(np.sign(opening) * odd + share * np.maximum(odd - at_gap, 0.0))

    for _ in range(4):
        opening = mean[:, None] + amplitude[:, None] * cosine
        stiffness = np.mean(np.interp(np.abs(opening), x, slope), axis=1)
        mean = mean - np.mean(force(opening), axis=1) / np.maximum(stiffness, 0.05)
        mean = np.clip(mean, -amplitude, amplitude)
    total = force(mean[:, None] + amplitude[:, None] * cosine)
    angle = 2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    h = np.arange(1, count + 1)
    harmonics = 2 / SAMPLES * total @ np.cos(angle[:, None] * h)
    return np.where(h % 2 == 0, harmonics, 0.0).astype(complex)
