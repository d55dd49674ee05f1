"""Sparse matrices of a structure: few of a node's motions meet another's, and work grows with those that do.

A matrix of few coordinates is dense all the same, :func:`handy`: there LAPACK is quicker and as exact as it gets.
"""

import numpy as np
from scipy.linalg import block_diag
from scipy.sparse import block_diag as sparse_block_diag
from scipy.sparse import csc_array, csr_array, issparse
from scipy.sparse.linalg import splu

from twin.arrays import Array
from twin.structure.limits import LIMITS


def from_blocks(rows: Array, columns: Array, values: Array, size: int) -> csr_array:
    """The sum of blocks (e, a, b) at rows (e, a) and columns (e, b), over `size` displacements."""
    at = np.broadcast_to(rows[:, :, None], values.shape), np.broadcast_to(columns[:, None, :], values.shape)
    return csr_array((values.ravel(), (at[0].ravel(), at[1].ravel())), shape=(size, size))


def handy(A: csr_array) -> Array | csr_array:
    """Dense where that is quicker."""
    return A.toarray() if A.shape[0] <= LIMITS.dense_up_to else A


def with_square(A: Array | csr_array, scale: float, row: Array) -> Array | csr_array:
    """A + scale row' row: a spring, a dashpot or a mass on one motion, (n,)."""
    if not issparse(A):
        return np.asarray(A + scale * np.outer(row, row))
    of_row = csr_array(row[None])
    return csr_array(A + scale * (of_row.T @ of_row))


def with_coordinate(A: Array | csr_array, own: float = 0.0) -> Array | csr_array:
    """A with one more coordinate, which meets no other."""
    return csr_array(sparse_block_diag([A, [[own]]])) if issparse(A) else np.asarray(block_diag(A, own))


def solved(A: Array | csr_array, right: Array) -> Array:
    """Solutions (n, m) of a regular system."""
    return np.asarray(splu(csc_array(A)).solve(right) if issparse(A) else np.linalg.solve(A, right))
