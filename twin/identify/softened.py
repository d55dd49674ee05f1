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
        if len(self.places) - first < self.stack:
            out.fill(np.nan)
        modes = (basis.omega, basis.zeta)
        springs = np.ascontiguousarray(S, complex)
        _receptance(out, omega, *modes, self.shapes, self.static, self.static2, springs, self.places, first)
        return out


def softened_receptance_numpy(basis: ModalBasis, rows: Real, omega: Real, S: Complex) -> Complex:
    """Plain numpy twin: all receptances, then Woodbury's formula for springs S on the first ports."""
    return update_receptance_numpy(basis.receptance(rows, omega), slice(0, S.shape[1]), S)


@numba.njit(cache=True, error_model="numpy", nogil=True)
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
    """Fill in `out` between the ports from the `first` one on; real and imaginary parts apart, for the vector units."""
    count, pairs = len(places), shapes.shape[1]
    real, imag = np.empty(pairs), np.empty(pairs)
    cr, ci = np.empty(count), np.empty(count)
    for f in range(len(omega)):
        w = omega[f]
        for t in range(pairs):
            real[t] = static[t] + w * w * static2[t]
            imag[t] = 0.0
        for m in range(len(omega_r)):
            D = 1.0 / complex(omega_r[m] ** 2 - w * w, 2 * zeta[m] * omega_r[m] * w)
            dr, di = D.real, D.imag
            for t in range(pairs):
                real[t] += shapes[m, t] * dr
                imag[t] += shapes[m, t] * di
        for k in range(S.shape[1]):
            spring = S[f, k]
            # A spring that is not asked for afterwards need not be kept up.
            least = min(k + 1, first)
            for i in range(least, count):
                t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
                cr[i], ci[i] = real[t], imag[t]
            t = k * (k + 1) // 2 + k
            own = 1.0 / (1.0 + spring * complex(real[t], imag[t]))
            for i in range(least, count):
                if i != k:
                    scaled = spring * own * complex(cr[i], ci[i])
                    sr, si = scaled.real, scaled.imag
                    row = i * (i + 1) // 2
                    for j in range(least, i + 1):
                        real[row + j] -= sr * cr[j] - si * ci[j]
                        imag[row + j] -= sr * ci[j] + si * cr[j]
            # Not by difference: a stiff spring leaves little.
            if first <= k:
                for i in range(count):
                    t = i * (i + 1) // 2 + k if i >= k else k * (k + 1) // 2 + i
                    value = own * complex(cr[i], ci[i])
                    real[t], imag[t] = value.real, value.imag
        for i in range(first, count):
            row = i * (i + 1) // 2
            for j in range(first, i + 1):
                value = complex(real[row + j], imag[row + j])
                out[f, places[i], places[j]] = value
                out[f, places[j], places[i]] = value
