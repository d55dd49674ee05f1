"""Bending modes of a structure: the modes that a table of natural frequencies counts."""

import numpy as np
from numpy.typing import NDArray

from twin.structure.modes import Modes, normal_modes

Matrix = NDArray[np.float64]


def bending_modes(M: Matrix, K: Matrix, transverse: NDArray[np.bool_], *, least: int) -> Modes:
    """At least so many bending modes, from the lowest, without a gap.

    More than half of a bending mode's kinetic energy is transverse, and it is no rigid-body motion.

    Parameters
    ----------
    M, K : ndarray, (n, n)
    transverse : ndarray of bool, (n,)
        Degrees of freedom that move across the beams.

    Raises
    ------
    ValueError
        If the model has fewer.
    """
    modes = normal_modes(M, K, min(len(M), 2 * least + 8))
    t = transverse
    kinetic = np.einsum("im,im->m", modes.Phi[t], M[np.ix_(t, t)] @ modes.Phi[t])
    elastic = modes.omega > 1e-3 * modes.omega[-1] / len(modes.omega) ** 2
    bending = np.flatnonzero((kinetic > 0.5) & elastic)
    if len(bending) < least:
        raise ValueError(f"the model has {len(bending)} bending modes, {least} are needed")
    return Modes(modes.omega[bending], modes.Phi[:, bending])
