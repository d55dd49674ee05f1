"""Plain numpy twin of the compiled harmonics of a slider: all steps at once, by another search and another solve."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from twin.identify.jenkins import RIPPLES, _turned, common_spring, jenkins_harmonics
from twin.identify.slipping_kernel import PASSES, _bracket

__all__ = ["slipping_harmonics_numpy"]

Array = NDArray[Any]


def slipping_harmonics_numpy(amplitude: Any, k: float, slip_force: float, compliance: Array) -> Array:
    """What :func:`twin.identify.slipping.slipping_harmonics` returns."""
    a = np.atleast_1d(np.asarray(amplitude, float))
    C = np.broadcast_to(compliance, (len(a), len(RIPPLES)))
    c, rippled = common_spring(C), np.zeros(len(a), complex)
    softer, rest = k / (1 + k * c), C - c[:, None]
    orders = np.array([1, *RIPPLES])
    for _ in range(PASSES):
        y = np.array([_beyond(*one, slip_force) for one in zip(a, c, rippled, softer, strict=True)])
        alone = np.vstack(
            [jenkins_harmonics([v], one, slip_force, orders[-1]) for v, one in zip(y, softer, strict=True)]
        )
        F = _rippling(y, softer, slip_force, alone[:, orders - 1], rest)
        rippled = F[:, 0] - alone[:, 0]
    slip = y - c * F[:, 0]
    return np.asarray(F * (np.conj(slip) / np.maximum(np.abs(slip), 1e-300))[:, None] ** orders)


def _beyond(a: float, c: float, rippled: complex, softer: float, slip_force: float) -> float:
    """Amplitude beyond the common spring at which the slip's is a."""

    def miss(y: float) -> float:
        return float(np.abs(y - c * (jenkins_harmonics([y], softer, slip_force, 1)[0, 0] + rippled)) - a)

    low, high = _bracket.py_func(a, c, abs(rippled), softer)
    return low if c == 0.0 else float(brentq(miss, low, high, xtol=1e-15 * a, rtol=1e-14))


def _rippling(y: Array, k: Array, slip_force: float, alone: Array, compliance: Array) -> Array:
    orders = np.array([1, *RIPPLES])
    ky = k[:, None] * y[:, None]
    t = np.arccos(np.clip(1 - 2 * np.minimum(slip_force, ky) / np.maximum(ky, 1e-300), -1.0, 1.0))
    integrals = _turned(np.arange(-orders[-1], 2 * orders[-1] + 1), t)

    def integral(n: Array) -> Array:
        return integrals[:, n + orders[-1]]

    ripples = orders[1:]
    start, stiffness = integral(orders)[:, :, None], k[:, None, None] / np.pi
    by_ripple = stiffness * (integral(orders[:, None] - ripples) - start)
    by_conjugate = stiffness * (integral(orders[:, None] + ripples) - start)
    both = np.concatenate([by_ripple + by_conjugate, 1j * (by_ripple - by_conjugate)], axis=2)
    return _balanced(alone, both, compliance)


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
