"""Normal modes of the undamped structure, and which of them are rigid motions or bending modes."""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh
from scipy.sparse import csc_array, csr_array, issparse
from scipy.sparse.linalg import eigsh

from twin.arrays import Array
from twin.structure.limits import LIMITS

MOST_RIGID = 6


@dataclass(frozen=True)
class Modes:
    """Natural frequencies omega (rad/s), rising, and mass-normalised mode shapes as columns of Phi, (n, m)."""

    omega: Array
    Phi: Array

    @property
    def frequency_Hz(self) -> Array:
        """Natural frequencies in Hz."""
        return self.omega / (2 * np.pi)


def normal_modes(M: Array | csr_array, K: Array | csr_array, count: int | None = None) -> Modes:
    """The lowest `count` modes, or all of them; of sparse matrices by Lanczos, from a start that is always the same.

    Rigid-body modes come out with omega = 0 instead of the root of a tiny negative number.
    """
    if issparse(M):
        assert count is not None
        shift, start = -LIMITS.lanczos_shift_rad2_per_s2, np.ones(M.shape[0])
        values, Phi = eigsh(csc_array(K), count, csc_array(M), sigma=shift, v0=start, tol=0)
        order = np.argsort(values)
        return Modes(np.sqrt(np.maximum(values[order], 0.0)), Phi[:, order])
    subset = None if count is None else (0, min(count, len(M)) - 1)
    values, Phi = eigh(K, M, subset_by_index=subset)
    return Modes(np.sqrt(np.maximum(values, 0.0)), Phi)


def rigid_motions(omega: Array) -> int:
    """How many of rising natural frequencies are those of motions that nothing holds: six at most, of one body."""
    elastic = omega[min(MOST_RIGID, len(omega) - 1)]
    return int(np.count_nonzero(omega[:MOST_RIGID] < LIMITS.modes_rigid * elastic))


def elastic_modes(M: Array | csr_array, K: Array | csr_array, count: int) -> Modes:
    """The lowest `count` modes that strain something."""
    modes = normal_modes(M, K, count + MOST_RIGID)
    first = rigid_motions(modes.omega)
    return Modes(modes.omega[first : first + count], modes.Phi[:, first : first + count])


def shifted_modes(M: Array, K: Array, count: int, *, shift: float) -> Modes:
    """The lowest `count` modes as the largest 1 / (omega^2 + shift): exact in the low ones, with negative masses too.

    `shift`, rad2/s2, is far below the squares of the elastic frequencies.
    """
    n = len(M)
    inverse, Phi = eigh(M, K + shift * M, subset_by_index=(max(n - count, 0), n - 1))
    inverse, Phi = inverse[::-1], Phi[:, ::-1]
    inverse, Phi = inverse[inverse > 0], Phi[:, inverse > 0]
    return Modes(np.sqrt(np.maximum(1 / inverse - shift, 0.0)), Phi / np.sqrt(inverse))


def are_counted(M: Array, Phi: Array, counted: Array) -> Array:
    """Which mass-normalised modes (n, m) have more than half of their kinetic energy in the coordinates that count."""
    return np.asarray(np.einsum("im,im->m", Phi[counted], M[np.ix_(counted, counted)] @ Phi[counted]) > 0.5)


def counted_modes(M: Array, K: Array, counted: Array, *, least: int, shift: float | None = None) -> Modes:
    """At least so many modes that count, from the lowest, without a gap, and no rigid-body motion.

    ValueError if the model has fewer.

    Parameters
    ----------
    M, K : ndarray, (n, n)
    counted : ndarray of bool, (n,)
        Coordinates that have most of such a mode, see :attr:`Structure.counted`.
    shift
        As of :func:`shifted_modes`, which is used with it.
    """
    count = min(len(M), 2 * least + 8)
    modes = normal_modes(M, K, count) if shift is None else shifted_modes(M, K, count, shift=shift)
    elastic = np.arange(len(modes.omega)) >= rigid_motions(modes.omega)
    found = np.flatnonzero(are_counted(M, modes.Phi, counted) & elastic)
    if len(found) < least:
        raise ValueError(f"the model has {len(found)} such modes, {least} are needed")
    return Modes(modes.omega[found], modes.Phi[:, found])
