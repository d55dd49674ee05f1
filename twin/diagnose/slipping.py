"""Harmonics of a slider that sticks until its force is reached, in a structure that lets its slip ripple."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from twin.identify.elimination import eliminate

__all__ = [
    "RIPPLES",
    "jenkins_harmonics",
    "slipping_harmonics",
    "slipping_harmonics_numpy",
]

Array = NDArray[Any]

RIPPLES = (3, 5, 7)
"""Harmonics of the slip that are balanced.  Without the third a slip force comes out wrong by several per cent."""


def jenkins_harmonics(amplitude: Any, k: float, slip_force: float, count: int) -> Array:
    """Harmonics 1 ... count (s, count) of a Jenkins element's steady force for motion a cos t, in closed form.

    On the way down from a reversal at +a the force falls from the slip force F (or k a while it never slips) with slope
    k until, at cos t_s = 1 - 2 F / (k a), it slips the other way; the way up mirrors it, so that even harmonics vanish.
    Quadrature would not do: its error jumps as the slip's beginning passes a sample, and the fit's derivatives with it.
    """
    a = np.asarray(amplitude, float)[:, None]
    top, t = _sticks_until(a, k, slip_force)
    h = np.arange(1, count + 1)
    sticking = (top - k * a) * _turned(h, t) + k * a / 2 * (_turned(h - 1, t) + _turned(h + 1, t))
    slipping = -top * (_turned(h, np.pi) - _turned(h, t))
    return np.where(h % 2, 2 / np.pi * (sticking + slipping), 0.0)


def slipping_harmonics(amplitude: Any, k: float, slip_force: float, compliance: Array) -> Array:
    """Harmonics 1, 3, 5, 7 of a Jenkins element's force where only the fundamental a cos t of its slip is given.

    The force's harmonics move the slip, X_h = -C_h F_h, and that ripple the force.  To first order a ripple e(t)
    changes the force by k (e(t) - e(0)) from the reversal until it slips, and not at all after that.

    Parameters
    ----------
    amplitude : ndarray, (s,)
    compliance : ndarray, (s, 3)
        Slip per force on it at 3, 5 and 7 times the frequency, without the element.

    Returns
    -------
    ndarray, (s, 4)
    """
    a = np.atleast_1d(np.asarray(amplitude, float))
    count = len(RIPPLES)
    alone, both = np.empty((len(a), 1 + count), complex), np.empty((len(a), 1 + count, 2 * count), complex)
    _by_ripples(a, float(k), float(slip_force), alone, both)
    _balance(alone, both, np.ascontiguousarray(np.broadcast_to(compliance, (len(a), count)), complex))
    return alone


def slipping_harmonics_numpy(amplitude: Any, k: float, slip_force: float, compliance: Array) -> Array:
    """Plain numpy twin of :func:`slipping_harmonics`."""
    a = np.asarray(amplitude, float)[:, None]
    orders = np.array([1, *RIPPLES])
    alone = jenkins_harmonics(amplitude, k, slip_force, orders[-1])[:, orders - 1]
    _, t = _sticks_until(a, k, slip_force)
    integrals = _turned(np.arange(-orders[-1], 2 * orders[-1] + 1), t)

    def integral(n: Array) -> Array:
        return integrals[:, n + orders[-1]]

    ripples = orders[1:]
    start = integral(orders)[:, :, None]
    by_ripple = k / np.pi * (integral(orders[:, None] - ripples) - start)
    by_conjugate = k / np.pi * (integral(orders[:, None] + ripples) - start)
    both = np.concatenate([by_ripple + by_conjugate, 1j * (by_ripple - by_conjugate)], axis=2)
    return _balanced(alone, both, compliance)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _by_ripples(amplitude: Array, k: float, slip_force: float, alone: Array, both: Array) -> None:
    """Fill in the harmonics (s, 4) without ripples, and what the ripples' real and imaginary parts (s, 4, 6) add."""
    highest = RIPPLES[-1]
    integrals = np.empty(3 * highest + 1, np.complex128)
    for s in range(len(amplitude)):
        a = amplitude[s]
        top = min(slip_force, k * a)
        cosine = min(max(1 - 2 * top / max(k * a, 1e-300), -1.0), 1.0)
        t = np.arccos(cosine)
        turn = complex(cosine, -np.sin(t))
        power = 1.0 + 0j
        integrals[highest] = t
        for n in range(1, 2 * highest + 1):
            power = power * turn
            value = 1j * (power - 1) / n
            integrals[highest + n] = value
            if n <= highest:
                integrals[highest - n] = value.conjugate()
        for i in range(1 + len(RIPPLES)):
            h = RIPPLES[i - 1] if i else 1
            start = integrals[highest + h]
            # exp(-j h pi) = -1, for all of these are odd.
            whole = -2j / h
            sticking = (top - k * a) * start + k * a / 2 * (integrals[highest + h - 1] + integrals[highest + h + 1])
            alone[s, i] = 2 / np.pi * (sticking - top * (whole - start))
            for j in range(len(RIPPLES)):
                ripple = k / np.pi * (integrals[highest + h - RIPPLES[j]] - start)
                conjugate = k / np.pi * (integrals[highest + h + RIPPLES[j]] - start)
                both[s, i, j] = ripple + conjugate
                both[s, i, j + len(RIPPLES)] = 1j * (ripple - conjugate)


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _balance(alone: Array, both: Array, compliance: Array) -> None:
    """What :func:`_balanced` returns, in place of `alone`."""
    count = len(RIPPLES)
    J, X = np.empty((2 * count, 2 * count)), np.empty(2 * count)
    for s in range(len(alone)):
        for i in range(count):
            C = compliance[s, i]
            given = -C * alone[s, 1 + i]
            X[i], X[count + i] = given.real, given.imag
            for j in range(2 * count):
                moved = C * both[s, 1 + i, j]
                J[i, j], J[count + i, j] = moved.real, moved.imag
            J[i, i] += 1.0
            J[count + i, count + i] += 1.0
        eliminate(J, X)
        for i in range(1 + count):
            for j in range(2 * count):
                alone[s, i] += both[s, i, j] * X[j]


def _balanced(alone: Array, both: Array, compliance: Array) -> Array:
    """Harmonics with the ripples X = -C (F + A X + B X*) that they make, in real and imaginary parts."""
    moved = compliance[:, :, None] * both[:, 1:]
    count = len(RIPPLES)
    moved[:, :, :count] += np.eye(count)
    moved[:, :, count:] += 1j * np.eye(count)
    given = -compliance * alone[:, 1:]
    X = np.linalg.solve(
        np.concatenate([moved.real, moved.imag], axis=1), np.concatenate([given.real, given.imag], axis=1)[:, :, None]
    )
    return np.asarray(alone + (both @ X)[:, :, 0])


def _sticks_until(a: Array, k: float, slip_force: float) -> tuple[Array, Array]:
    """Largest force, and the angle after a reversal at which the element slips; pi if it does not."""
    top = np.minimum(slip_force, k * a)
    return top, np.arccos(np.clip(1 - 2 * top / np.maximum(k * a, 1e-300), -1.0, 1.0))


def _turned(n: Any, t: Any) -> Array:
    """Integral of exp(-j n t) from zero to t."""
    return np.asarray(np.where(n == 0, t + 0j, 1j * (np.exp(-1j * n * t) - 1) / np.where(n, n, 1)))
