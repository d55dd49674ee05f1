"""Even harmonics of a joint that loses contact where it opens, beside whatever softening it has."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import PchipInterpolator

from twin.identify.extension import JointState

__all__ = ["odd_force", "opening_harmonics"]

Array = NDArray[Any]
Force = Callable[[Array], tuple[Array, Array]]
"""Values and tangents of a force along samples of its coordinate."""

KNOTS, GRID, SAMPLES = 24, 160, 128
SMOOTHNESS = 0.01
"""Weight of a curve's bends beside its distance from the points."""
LEAST_TANGENT = 0.02
TURNS = 8
"""Newton steps of the balance; four or five are usual."""
BALANCED = 1e-7
"""Newton step over the amplitude at which the harmonics are in balance."""
OWN_TURNS = 3
"""Corrections of the odd part."""
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
    root = np.sqrt(amplitude)
    nodes = np.linspace(root.min(), root.max(), KNOTS)
    a, N = nodes**2, _smooth(root, secant, nodes)
    curve = PchipInterpolator(np.append(0.0, a), np.append(N[0], N))
    slope = curve.derivative()
    x = np.linspace(0.0, a[-1], GRID)
    sine = np.sin((NODES + 1) * np.pi / 4)
    A = np.minimum(x[:, None] * sine, a[-1])
    integrand = 3 * sine**3 * curve(A) + x[:, None] * sine**4 * slope(A)
    force = x / 2 * (integrand @ WEIGHTS) * np.pi / 4
    # The inverse amplifies errors at the largest amplitudes, but a passive layer never has a negative tangent.
    return x, np.concatenate([[0.0], np.cumsum(np.maximum(np.diff(force), LEAST_TANGENT * (x[1] - x[0])))])


def _smooth(x: Array, y: Array, nodes: Array) -> Array:
    """Values at evenly spaced nodes of the smooth curve through the points; straight where there are none."""
    place = np.clip((x - nodes[0]) / (nodes[1] - nodes[0]), 0, len(nodes) - 1)
    hats = np.maximum(0.0, 1 - np.abs(place[:, None] - np.arange(len(nodes))))
    bend = np.diff(np.eye(len(nodes)), 2, axis=0)
    return np.asarray(np.linalg.solve(hats.T @ hats + SMOOTHNESS * bend.T @ bend, hats.T @ y))


def opening_harmonics(amplitude: Array, joint: JointState, *, gap: float, factor: float, count: int) -> Array:
    """Harmonics 1 ... count of the even part of the force, for motion whose fundamental is a cos t.

    A joint whose force beyond the gap goes on with `factor` of its slope has an odd part f, which is what the
    fundamental shows, and the even part (factor - 1) / (factor + 1) (f(|x|) - f(gap)) beyond the gap.  That force moves
    the joint's mean opening and its higher harmonics, and they in turn the force: a harmonic balance of the opening,
    with the structure around it as its compliance, settles them.

    Parameters
    ----------
    amplitude : ndarray, (s,)
        Of the opening's fundamental, m.
    joint
        The whole joint's secant stiffness, and what surrounds it.

    Returns
    -------
    ndarray, (s, count)
        In units of the linear stiffness times metres: the force less the secant stiffness times the opening; odd
        harmonics are zero.
    """
    share = (factor - 1) / (factor + 1)
    h = np.arange(1, count + 1)
    own, X = joint.left, None
    for _ in range(OWN_TURNS):
        total, X = _balance(_slapping(*odd_force(amplitude, own), joint.left, share, gap), amplitude, joint, X)
        harmonics = _coefficients(total, count)[:, 1:]
        # Mean opening and harmonics act on the fundamental: the odd part alone has another describing function.
        own = own - harmonics[:, 0].real / amplitude
    return np.where(h % 2 == 0, harmonics, 0.0)


def _slapping(x: Array, f: Array, secant: Array, share: float, gap: float) -> Force:
    """The joint's force beyond its secant stiffness: odd part f on a grid x, and what is even beyond the gap."""
    slope = np.gradient(f, x)
    at_gap = np.interp(gap, x, f)

    def force(opening: Array) -> tuple[Array, Array]:
        size = np.abs(opening)
        # Beyond the table the force goes on along its last slope.
        odd = np.interp(size, x, f) + np.maximum(size - x[-1], 0.0) * slope[-1]
        tangent = np.interp(size, x, slope) * (1 + share * np.sign(opening) * (size > gap))
        total = np.sign(opening) * odd + share * np.maximum(odd - at_gap, 0.0)
        return total - secant[:, None] * opening, tangent - secant[:, None]

    return force


def _balance(force: Force, amplitude: Array, joint: JointState, start: Array | None) -> tuple[Array, Array]:
    """Samples (s, t) of a force on a coordinate whose fundamental is given, all other harmonics in balance.

    Newton on the real and imaginary parts of the harmonics X_h = -C_h F_h(x), h = 0, 2 ... H; returned as well, to
    begin from.
    """
    H = joint.compliance.shape[1] - 1
    orders = np.array([0, *range(2, H + 1)])
    angle = 2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    # Columns: the coordinate's samples by each real unknown; the mean has no imaginary part.
    waves = np.concatenate([np.cos(angle[:, None] * orders), -np.sin(angle[:, None] * orders[1:])], axis=1)
    weight = np.where(orders == 0, 1.0, 2.0)
    project = (np.exp(-1j * orders[:, None] * angle) * weight[:, None] / SAMPLES).T
    C = joint.compliance[:, orders]
    X = np.zeros((len(amplitude), waves.shape[1])) if start is None else start
    fundamental = amplitude[:, None] * np.cos(angle)
    for _ in range(TURNS):
        values, tangent = force(fundamental + X @ waves.T)
        residual = _parts(C * (values @ project)) + X
        J = np.moveaxis(_parts(np.moveaxis(_by_unknowns(tangent, orders) * C[:, :, None], 1, 2)), 1, 2)
        J += np.eye(X.shape[1])
        step = np.linalg.solve(J, residual[:, :, None])[:, :, 0]
        size = np.max(np.abs(step), axis=1) / amplitude
        # A contact opens within a step: no step larger than the motion itself is to be trusted.
        X = X - step * np.minimum(1.0, 0.5 / np.maximum(size, 1e-300))[:, None]
        if np.max(size) < BALANCED:
            break
    return force(fundamental + X @ waves.T)[0], X


def _by_unknowns(tangent: Array, orders: Array) -> Array:
    """Harmonics (s, h, u) of a force by the real unknowns of its coordinate: Toeplitz and Hankel in the tangent's."""
    most = 2 * orders[-1]
    c = _coefficients(tangent, most) / 2
    both = np.concatenate([np.conj(c[:, :0:-1]), c], axis=1)
    less, more = (both[:, most + orders[:, None] + sign * orders] for sign in (-1, 1))
    weight = np.where(orders == 0, 0.5, 1.0)[:, None]
    return np.concatenate([weight * (less + more), (1j * weight * (less - more))[:, :, 1:]], axis=2)


def _parts(values: Array) -> Array:
    """Real parts of all, then imaginary parts of all but the first, along the last axis."""
    return np.concatenate([values.real, values.imag[..., 1:]], axis=-1)


def _coefficients(samples: Array, count: int) -> Array:
    """Fourier coefficients 0 ... count."""
    angle = 2 * np.pi * (np.arange(SAMPLES) + 0.5) / SAMPLES
    weights = np.exp(-1j * angle[:, None] * np.arange(count + 1)) * 2 / SAMPLES
    return np.asarray(samples @ weights)
