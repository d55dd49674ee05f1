"""Newton's systems: by hand while they are small, where a call costs more than the work, and by LAPACK beyond."""

import numpy as np
from numpy.typing import NDArray

from twin.joint.elimination import eliminate_columns
from twin.joint.kernel import COMPILED

Matrix = NDArray[np.float64]

BY_HAND = 64
"""Most unknowns that are eliminated by hand; a little above, LAPACK takes the same time."""


@COMPILED
def solve(A: Matrix, right: Matrix) -> None:
    """Replace the right sides, (n, m), by the solutions; A, (n, n), is lost, and of a singular one none is finite."""
    if A.shape[0] <= BY_HAND:
        eliminate_columns(A, right)
        return
    try:
        right[:] = np.linalg.solve(A, right)
    except Exception:  # compiled code knows no other
        right[:] = np.nan
