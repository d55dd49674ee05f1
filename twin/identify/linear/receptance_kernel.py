"""Springs put in at ports for a few frequencies side by side, one in each lane of the vector registers.

Their matrices never leave the processor's cache: where the layer has other moduli than its modes were computed with,
together with the modal sum over pairs of ports (see :mod:`twin.identify.linear.receptance`).  Springs that are not
asked for afterwards drop out of the matrix as they are put in.
"""

from typing import Any

import numba
import numpy as np

from twin.arrays import Array
from twin.joint.compilation import INNER, INSIDE, OPTIONS

FASTER = {"reassoc", "contract", "arcp", "nsz"}
LANES = 16
"""Frequencies side by side: enough to fill vectors, few enough for the cache."""


@numba.njit(**OPTIONS, fastmath=FASTER)
def fill_in(
    out: Array, omega: Array, poles: tuple[Array, Array], terms: Array, S: Array, places: Any, first: int
) -> None:
    """Fill in `out` between the ports from the `first` one on, which is 0 or the number of springs; NaN elsewhere.

    Real parts of what the lanes hold come first, imaginary parts LANES behind.
    """
    count, springs, last = len(places), S.shape[1], len(omega) - 1
    w, factors = np.empty(LANES, np.complex128), np.empty((terms.shape[1], 2 * LANES))
    R, spring = np.empty((len(terms), 2 * LANES)), np.empty((springs, 2 * LANES))
    column, scaled = np.empty((count, 2 * LANES)), np.empty((count, 2 * LANES))
    for begin in range(0, len(omega), LANES):
        for n in range(LANES):
            f = min(begin + n, last)  # lanes that are left over repeat the last frequency
            w[n] = omega[f]
            for k in range(springs):
                spring[k, n], spring[k, LANES + n] = S[f, k].real, S[f, k].imag
        _factors(factors, w, *poles)
        np.dot(terms, factors, R)
        for k in range(springs):
            _put_in(R, spring[k], k, 0 if first == 0 else k + 1, column, scaled)
        for n in range(min(LANES, last + 1 - begin)):
            matrix = out[begin + n]
            if count - first < len(matrix):
                matrix[:] = np.nan
            for i in range(first, count):
                row = i * (i + 1) // 2
                for j in range(first, i + 1):
                    value = complex(R[row + j, n], R[row + j, LANES + n])
                    matrix[places[i], places[j]] = value
                    matrix[places[j], places[i]] = value


@numba.njit(**OPTIONS, fastmath=FASTER)
def put_in_all(out: Array, free: Array, ports: Any, S: Array) -> None:
    """Fill in `out` with the receptances `free` after springs at `ports`, a few frequencies at a time."""
    count, springs, last = free.shape[1], len(ports), len(free) - 1
    R, spring = np.empty((count * (count + 1) // 2, 2 * LANES)), np.empty((springs, 2 * LANES))
    column, scaled = np.empty((count, 2 * LANES)), np.empty((count, 2 * LANES))
    for begin in range(0, len(free), LANES):
        for n in range(LANES):
            f = min(begin + n, last)
            for k in range(springs):
                spring[k, n], spring[k, LANES + n] = S[f, k].real, S[f, k].imag
            for i in range(count):
                for j in range(i + 1):
                    t = i * (i + 1) // 2 + j
                    R[t, n], R[t, LANES + n] = free[f, i, j].real, free[f, i, j].imag
        for k in range(springs):
            _put_in(R, spring[k], ports[k], 0, column, scaled)
        for n in range(min(LANES, last + 1 - begin)):
            for i in range(count):
                for j in range(i + 1):
                    t = i * (i + 1) // 2 + j
                    out[begin + n, i, j] = out[begin + n, j, i] = complex(R[t, n], R[t, LANES + n])


@INNER
def _factors(factors: Array, w: Array, omega_r: Array, zeta: Array) -> None:
    """What the terms are multiplied by, (m + 2, 2 LANES): each mode's receptance per unit shape, 1 and omega^2.

    To the last bit, for at a mode's resonance rounding is magnified.
    """
    modes = len(omega_r)
    for m in range(modes):
        for n in range(LANES):
            damping = 2 * zeta[m] * omega_r[m]
            a = omega_r[m] * omega_r[m] - (w[n].real - w[n].imag) * (w[n].real + w[n].imag) - damping * w[n].imag
            b = damping * w[n].real - 2 * w[n].real * w[n].imag
            square = a * a + b * b
            factors[m, n], factors[m, LANES + n] = a / square, -b / square
    for n in range(LANES):
        factors[modes, n], factors[modes, LANES + n] = 1.0, 0.0
        x, y = w[n].real, w[n].imag
        factors[modes + 1, n], factors[modes + 1, LANES + n] = x * x - y * y, 2 * x * y


@numba.njit(**INSIDE, fastmath=FASTER)
def _put_in(R: Array, spring: Array, k: int, first: int, column: Array, scaled: Array) -> None:
    """Put in one spring at port k: R - c s/(1 + s R_kk) c^T with its column c; only ports from `first` on are kept up.

    `spring` is (2 LANES,), `first` 0 or k + 1; `column` and `scaled`, (p, 2 LANES), are room to work in.
    """
    L = LANES
    own = k * (k + 1) // 2 + k
    for n in range(L):
        # 1 / (1 + s R_kk)
        a = 1.0 + spring[n] * R[own, n] - spring[L + n] * R[own, L + n]
        b = spring[n] * R[own, L + n] + spring[L + n] * R[own, n]
        square = 1.0 / (a * a + b * b)
        scaled[k, n], scaled[k, L + n] = a * square, -b * square
    for i in range(first, len(column)):
        t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
        for n in range(2 * L):
            column[i, n] = R[t, n]
    for i in range(first, len(column)):
        if i == k:
            continue
        for n in range(L):
            u = spring[n] * scaled[k, n] - spring[L + n] * scaled[k, L + n]
            v = spring[n] * scaled[k, L + n] + spring[L + n] * scaled[k, n]
            scaled[i, n] = u * column[i, n] - v * column[i, L + n]
            scaled[i, L + n] = u * column[i, L + n] + v * column[i, n]
        row = i * (i + 1) // 2
        for j in range(first, i + 1):
            for n in range(L):
                R[row + j, n] -= scaled[i, n] * column[j, n] - scaled[i, L + n] * column[j, L + n]
                R[row + j, L + n] -= scaled[i, n] * column[j, L + n] + scaled[i, L + n] * column[j, n]
    if first == 0:
        # Not by difference: a stiff spring leaves little.
        for i in range(len(column)):
            t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
            for n in range(L):
                R[t, n] = scaled[k, n] * column[i, n] - scaled[k, L + n] * column[i, L + n]
                R[t, L + n] = scaled[k, n] * column[i, L + n] + scaled[k, L + n] * column[i, n]
