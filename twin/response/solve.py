"""Newton's systems: by hand while they are small, where a call costs more than the work, and by LAPACK beyond."""

from typing import Any

import numpy as np
from numba import types

from twin.arrays import Array
from twin.joint.elimination import eliminate_columns
from twin.joint.kernel import COMPILED

BY_HAND = 64
"""Most unknowns that are eliminated by hand; a little above, LAPACK takes the same time."""
_DOUBLES, _INTS, _D = types.CPointer(types.float64), types.CPointer(types.intc), ord("d")
_gesv: Any = types.ExternalFunction(
    "numba_xgesv", types.intc(types.char, types.intp, types.intp, _DOUBLES, types.intp, _INTS, _DOUBLES, types.intp)
)
"""scipy's LAPACK as numba's own solve calls it, whose checks take longer to compile than all of Newton's method."""


@COMPILED
def solve(A: Array, right: Array) -> None:
    """Replace the right sides, (n, m), by the solutions; A, (n, n), is lost, and of a singular one none is finite."""
    n, m = right.shape
    if n <= BY_HAND:
        eliminate_columns(A, right)
        return
    columns, rows, order = np.empty((n, n)), np.empty((m, n)), np.empty(n, np.intc)
    for i in range(n):
        for j in range(n):
            columns[j, i] = A[i, j]
        for j in range(m):
            rows[j, i] = right[i, j]
    singular = _gesv(_D, n, m, columns.ctypes, n, order.ctypes, rows.ctypes, n)
    for i in range(n):
        for j in range(m):
            right[i, j] = np.nan if singular != 0 else rows[j, i]
