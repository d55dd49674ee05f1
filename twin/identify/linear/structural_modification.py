"""Receptances of a rig with more stiffness at some of its ports (structural modification)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.linear.receptance import ModalBasis


@dataclass(frozen=True)
class PortPairs:
    """What of a modal basis the receptances between some ports need."""

    terms: Array
    """For each pair on and below the diagonal: products of both ports' modal displacements, remainder of the other
    modes, and its part that grows with omega^2, (t, m + 2)."""
    places: NDArray[np.intp]
    """Which ports of the stack they are; the softened ones come first, (p,)."""
    outer: int
    stack: int
    """Number of ports in the stack that are wanted at the least, its first ones, and of all."""

    @classmethod
    def of(cls, basis: ModalBasis, rows: Array, places: NDArray[np.intp], *, outer: int) -> PortPairs:
        """Pairs of the ports at `places` in the stack of `rows`, of which so many are outer ones."""
        some = rows[places]
        P = some @ basis.Phi
        below = np.tril_indices(len(some))
        statics = [(some @ F @ some.T)[below] for F in (basis.flexibility, basis.flexibility2)]
        return cls(np.column_stack([P[below[0]] * P[below[1]], *statics]), places, outer, len(rows))

    def receptance(self, basis: ModalBasis, omega: Array, S: Array, *, inner: bool) -> Array:
        """Receptances with stiffness S (f, r) on the first r of the ports, those that are softened.

        Parameters
        ----------
        basis
            Frequencies and damping of the modes; the shapes are those of :attr:`terms`.
        inner
            Whether receptances of the softened ports, and of those behind them, are wanted, too.

        Returns
        -------
        ndarray, (f, stack, stack) or (f, outer, outer)
            NaN between ports that are not among :attr:`places`.
        """
        from twin.identify.linear.receptance_kernel import fill_in  # which numba takes a while to load

        count = self.stack if inner else self.outer
        out = np.empty((len(omega), count, count), complex)
        springs = np.ascontiguousarray(S, complex)
        first = 0 if inner else S.shape[1]
        poles = basis.omega, basis.zeta
        fill_in(out, np.asarray(omega, complex), poles, self.terms, springs, self.places, first)
        return out


def update_receptance(R: Array, ports: slice | NDArray[np.intp], S: Array) -> Array:
    """Receptances after adding stiffness S (f, r) on some `ports`, one diagonal for each frequency.

    Parameters
    ----------
    R : ndarray, (f, p, p)
        Symmetric.
    """
    from twin.identify.linear.receptance_kernel import put_in_all  # which numba takes a while to load

    out = np.empty(R.shape, complex)
    at = np.arange(R.shape[1])[ports]
    put_in_all(out, np.ascontiguousarray(R, complex), at, np.ascontiguousarray(S, complex))
    return out


def attach(R: Array, ports: slice, Z: Array) -> Array:
    """Receptances after attaching dynamic stiffness Z, (f, p) or (f, p, p), to `ports`."""
    if Z.ndim == 2:
        return update_receptance(R, ports, Z)
    A = np.eye(Z.shape[1]) + R[:, ports, ports] @ Z
    T = Z @ np.linalg.solve(A, np.broadcast_to(np.eye(Z.shape[1]), A.shape))
    return R - R[:, :, ports] @ T @ R[:, ports, :]
