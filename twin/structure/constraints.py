"""Coordinates of a structure that is held and tied: what is left of all displacements once constraints hold."""

import numpy as np
from scipy.sparse import csr_array

from twin.arrays import Array
from twin.structure.limits import LIMITS


def free_coordinates(constraints: Array) -> tuple[csr_array, Array]:
    """Basis (n, f) of all displacements that satisfy ``constraints @ x = 0``, (c, n), and which of them are free (f,).

    Each constraint makes one displacement depend on the others; those that are free keep their values.  A constraint
    that the others contain says nothing more.
    """
    C = np.array(constraints, float)
    n = C.shape[1]
    pivots: list[int] = []
    rows: list[int] = []
    for number in range(len(C)):
        largest = np.max(np.abs(constraints[number]), initial=0.0)
        # The last of the largest: a tie's second part follows its first.
        candidates = np.abs(C[number])
        pivot = n - 1 - int(np.argmax(candidates[::-1])) if n else 0
        if largest == 0 or candidates[pivot] <= LIMITS.constraints_dependent * largest:
            continue
        C[number] /= C[number, pivot]
        for other in range(len(C)):
            if other != number and C[other, pivot] != 0:
                C[other] -= C[other, pivot] * C[number]
        pivots.append(pivot)
        rows.append(number)
    free = np.setdiff1d(np.arange(n), pivots)
    depend = -C[rows][:, free]
    which, on = np.nonzero(depend)
    at = np.concatenate([free, np.array(pivots, np.int64)[which]]), np.concatenate([np.arange(len(free)), on])
    return csr_array((np.concatenate([np.ones(len(free)), depend[which, on]]), at), shape=(n, len(free))), free
