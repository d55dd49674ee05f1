"""Receptances of a rig whose layer has other moduli than its modes were computed with, in one compiled pass.

The modal sum over pairs of ports and the springs that the layer gains or loses (see :mod:`twin.identify.receptance`)
are done frequency by frequency, so that a frequency's matrix never leaves the processor's cache.  Springs that are not
asked for afterwards drop out of the matrix as they are put in.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

from twin.identify.receptance import ModalBasis, update_receptance_numpy

__all__ = ["PortPairs", "softened_receptance_numpy"]

Complex = NDArray[Any]
Real = NDArray[Any]


@dataclass(frozen=True)
class PortPairs:
    """What of a modal basis the receptances between some ports need, for each pair on and below the diagonal.

    Attributes
    ----------
    shapes : ndarray, (m, t)
        Products of both ports' modal displacements.
    static, static2 : ndarray, (t,)
        Remainder of the other modes, and its part that grows with omega^2.
    places : ndarray, (p,)
        Which ports of the stack they are; the softened ones come first.
    stack : int
        Number of all ports.
    """

    shapes: Real
    static: Real
    static2: Real
    places: NDArray[np.intp]
    stack: int

    @classmethod
    def of(cls, basis: ModalBasis, rows: Real, places: NDArray[np.intp]) -> PortPairs:
        """Pairs of the ports at `places` in the stack of `rows`."""
        some = rows[places]
        P = some @ basis.Phi
        below = np.tril_indices(len(some))
        static, static2 = (some @ F @ some.T for F in (basis.flexibility, basis.flexibility2))
        shapes = np.ascontiguousarray((P[below[0]] * P[below[1]]).T)
        return cls(shapes, static[below], static2[below], places, len(rows))

    def receptance(self, basis: ModalBasis, omega: Real, S: Complex, *, inner: bool) -> Complex:
        """Receptances with stiffness S (f, r) on the first r of the ports, those that are softened.

        Parameters
        ----------
        basis
            Frequencies and damping of the modes; the shapes are those of :attr:`shapes`.
        inner
            Whether receptances of the softened ports are wanted, too; NaN without.

        Returns
        -------
        ndarray, (f, stack, stack)
            NaN between ports that are not among :attr:`places`.
        """
        out = np.empty((len(omega), self.stack, self.stack), complex)
        first = 0 if inner else S.shape[1]
        modes = (basis.omega, basis.zeta)
        springs = np.ascontiguousarray(S, complex)
        _receptance(out, omega, *modes, self.shapes, self.static, self.static2, springs, self.places, first)
        return out


def softened_receptance_numpy(basis: ModalBasis, rows: Real, omega: Real, S: Complex) -> Complex:
    """Plain numpy twin: all receptances, then Woodbury's formula for springs S on the first ports."""
    return update_receptance_numpy(basis.receptance(rows, omega), slice(0, S.shape[1]), S)


FASTER = {"reassoc", "contract", "arcp", "nsz"}
INLINED = numba.njit(inline="always")


@numba.njit(cache=True, error_model="numpy", nogil=True, fastmath=FASTER)
def _receptance(
    out: Complex,
    omega: Real,
    omega_r: Real,
    zeta: Real,
    shapes: Real,
    static: Real,
    static2: Real,
    S: Complex,
    places: Any,
    first: int,
) -> None:
    """Fill in `out` between the ports from the `first` one on, which is 0 or the number of springs; NaN elsewhere."""
    count, springs = len(places), S.shape[1]
    real, imag = np.empty(shapes.shape[1]), np.empty(shapes.shape[1])
    columns = np.empty((4, count))
    for f in range(len(omega)):
        _unsoftened(real, imag, omega[f], omega_r, zeta, shapes, static, static2)
        if first == 0:
            for k in range(springs):
                _spring(real, imag, columns, S[f, k], k)
        else:
            odd = springs % 2
            if odd:
                _dropped_spring(real, imag, columns, S[f, 0], 0)
            for k in range(odd, springs, 2):
                _dropped_pair(real, imag, columns, S[f, k], S[f, k + 1], k)
        R = out[f]
        for i in range(R.shape[0]):
            for j in range(R.shape[1]):
                R[i, j] = np.nan
        for i in range(first, count):
            row = i * (i + 1) // 2
            for j in range(first, i + 1):
                value = complex(real[row + j], imag[row + j])
                R[places[i], places[j]] = value
                R[places[j], places[i]] = value


@numba.njit(cache=True, error_model="numpy", nogil=True)
def _resonance(w: float, omega_r: float, zeta: float) -> complex:
    """A mode's receptance per unit shape; to the last bit, for at its resonance rounding is magnified."""
    return complex(1.0 / complex(omega_r**2 - w * w, 2 * zeta * omega_r * w))


@INLINED
def _unsoftened(
    real: Real, imag: Real, w: float, omega_r: Real, zeta: Real, shapes: Real, static: Real, static2: Real
) -> None:
    """The modal sum; real and imaginary parts apart, for the vector units."""
    pairs = len(real)
    for t in range(pairs):
        real[t] = static[t] + w * w * static2[t]
        imag[t] = 0.0
    for m in range(len(omega_r)):
        D = _resonance(w, omega_r[m], zeta[m])
        dr, di = D.real, D.imag
        for t in range(pairs):
            real[t] += shapes[m, t] * dr
            imag[t] += shapes[m, t] * di


@INLINED
def _spring(real: Real, imag: Real, columns: Real, spring: complex, k: int) -> None:
    """Put in one spring, at port k."""
    cr, ci = columns[0], columns[1]
    count = len(cr)
    for i in range(count):
        t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
        cr[i], ci[i] = real[t], imag[t]
    own = 1.0 / (1.0 + spring * complex(cr[k], ci[k]))
    for i in range(count):
        if i != k:
            scaled = spring * own * complex(cr[i], ci[i])
            sr, si = scaled.real, scaled.imag
            row = i * (i + 1) // 2
            for j in range(i + 1):
                real[row + j] -= sr * cr[j] - si * ci[j]
                imag[row + j] -= sr * ci[j] + si * cr[j]
    # Not by difference: a stiff spring leaves little.
    for i in range(count):
        t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
        value = own * complex(cr[i], ci[i])
        real[t], imag[t] = value.real, value.imag


@INLINED
def _dropped_spring(real: Real, imag: Real, columns: Real, spring: complex, k: int) -> None:
    """Put in one spring at port k, and keep up only the ports after it."""
    cr, ci = columns[0], columns[1]
    count = len(cr)
    for i in range(k, count):
        t = i * (i + 1) // 2 + k
        cr[i], ci[i] = real[t], imag[t]
    scale = spring / (1.0 + spring * complex(cr[k], ci[k]))
    for i in range(k + 1, count):
        scaled = scale * complex(cr[i], ci[i])
        sr, si = scaled.real, scaled.imag
        row = i * (i + 1) // 2
        for j in range(k + 1, i + 1):
            real[row + j] -= sr * cr[j] - si * ci[j]
            imag[row + j] -= sr * ci[j] + si * cr[j]


@INLINED
def _dropped_pair(real: Real, imag: Real, columns: Real, first: complex, second: complex, k: int) -> None:
    """Put in springs at ports k and k + 1, and keep up only the ports after them, reading and writing these once."""
    ar, ai, br, bi = columns[0], columns[1], columns[2], columns[3]
    count = len(ar)
    for i in range(k, count):
        t = i * (i + 1) // 2 + k
        ar[i], ai[i] = real[t], imag[t]
    a = first / (1.0 + first * complex(ar[k], ai[k]))
    above = a * complex(ar[k + 1], ai[k + 1])
    for i in range(k + 1, count):
        t = i * (i + 1) // 2 + k + 1
        value = complex(real[t], imag[t]) - above * complex(ar[i], ai[i])
        br[i], bi[i] = value.real, value.imag
    b = second / (1.0 + second * complex(br[k + 1], bi[k + 1]))
    for i in range(k + 2, count):
        u, v = a * complex(ar[i], ai[i]), b * complex(br[i], bi[i])
        ur, ui, vr, vi = u.real, u.imag, v.real, v.imag
        row = i * (i + 1) // 2
        for j in range(k + 2, i + 1):
            real[row + j] -= ur * ar[j] - ui * ai[j] + vr * br[j] - vi * bi[j]
            imag[row + j] -= ur * ai[j] + ui * ar[j] + vr * bi[j] + vi * br[j]
