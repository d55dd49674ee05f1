"""How natural frequencies move with a stiffness."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["eigenvalue_sensitivity"]


def eigenvalue_sensitivity(Phi: NDArray[np.float64], B: NDArray[np.float64]) -> NDArray[np.float64]:
    """d(omega_r^2)/dp for a stiffness that changes as dK/dp = B' B: the square of B phi_r, summed over its rows.

    Parameters
    ----------
    Phi : ndarray, (n, m)
        Mass-normalised mode shapes.
    B : ndarray, (r, n)
        Low-rank factor of dK/dp.

    Returns
    -------
    ndarray, (m,)
    """
    return np.sum((B @ Phi) ** 2, axis=0)
