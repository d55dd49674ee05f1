"""Least-squares fits of rational functions with one denominator: poles by order (pLSCF, Guillaume et al. 2003).

    H_o(omega) = B_o(z) / A(z),      z = exp(j omega dt),   all polynomials of the same order, real coefficients

Multiplied out, A H_o - B_o = 0 is linear.  Eliminating the numerators leaves one small matrix for the denominator,

    M = sum_o T_o - S_o' R_o^-1 S_o,      R = Re(Z'WZ),  S = -Re(Z'WHZ),  T = Re(Z'W|H|^2 Z),

whose leading blocks are those of all lower orders: a whole chart costs little more than its highest order.  With the
lowest coefficient held at one, poles that merely follow the noise come out unstable, and physical ones stable.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS


@dataclass(frozen=True)
class ChartPole:
    """A stable pole of one order's fit: a point of the stabilisation chart."""

    order: int
    frequency_Hz: float
    damping_ratio: float


def pole_chart(frequency_Hz: Array, H: Array, weight: Array, *, orders: Sequence[int]) -> tuple[ChartPole, ...]:
    """Stable poles with positive frequency of the fits of each order, rising in order and in frequency.

    Parameters
    ----------
    frequency_Hz : ndarray, (f,)
    H : ndarray, (f, o)
        Frequency responses of any quantities.
    weight : ndarray, (f, o)
        Inverse standard deviations.
    orders
        Of the polynomials; two for each mode.
    """
    last = max(orders)
    low, high = float(frequency_Hz[0]), float(frequency_Hz[-1])
    dt = LIMITS.rational_edge / (2 * high)
    R, S, T = _normal_matrices(2 * np.pi * frequency_Hz * dt, H, weight, last)
    chart = []
    for order in sorted(orders):
        n = order + 1
        M = np.sum(T[:, :n, :n], axis=0)
        for r, s in zip(R[:, :n, :n], S[:, :n, :n], strict=True):
            M = M - s.T @ np.linalg.lstsq(r, s, rcond=None)[0]
        coefficients = np.concatenate([[1.0], np.linalg.lstsq(M[1:, 1:], -M[1:, 0], rcond=None)[0]])
        z = np.roots(coefficients[::-1])
        poles = np.log(z[np.abs(z) > 0] + 0j) / dt
        omega = np.abs(poles)
        inside = (poles.real < 0) & (poles.imag > 0) & (omega > np.pi * low) & (omega < 2.4 * np.pi * high)
        chart += [
            ChartPole(order, float(w / (2 * np.pi)), float(-p.real / w))
            for p, w in sorted(zip(poles[inside], omega[inside], strict=True), key=lambda pair: float(pair[1]))
        ]
    return tuple(chart)


def _normal_matrices(angle: Array, H: Array, weight: Array, order: int) -> tuple[Array, Array, Array]:
    """R, S and T of all outputs, (o, n, n)."""
    outputs, n = H.shape[1], order + 1
    R, S, T = (np.zeros((outputs, n, n)) for _ in range(3))
    for start in range(0, len(angle), LIMITS.rational_chunk):
        piece = slice(start, start + LIMITS.rational_chunk)
        Z = np.exp(1j * np.outer(angle[piece], np.arange(n)))
        for o in range(outputs):
            w, h = weight[piece, o], H[piece, o]
            numerator, denominator = w[:, None] * Z, (w * h)[:, None] * Z
            R[o] += (numerator.conj().T @ numerator).real
            S[o] -= (numerator.conj().T @ denominator).real
            T[o] += (denominator.conj().T @ denominator).real
    return R, S, T
