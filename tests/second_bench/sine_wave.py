"""The complex amplitude of a periodic signal."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

HARMONICS = 5
"""Fitted together, so that none of them passes for another where a block holds no whole periods."""


def fundamental(signal: NDArray[np.float64], phases: NDArray[np.float64]) -> complex:
    """Amplitude a of Im(a exp(i phase)) in a signal, by least squares with its harmonics.

    Parameters
    ----------
    signal, phases : ndarray, (t,)
        Phases of the fundamental in rad.
    """
    orders = np.arange(1, HARMONICS + 1)[:, None] * phases
    columns = np.vstack([np.sin(orders), np.cos(orders), np.ones(len(phases))])
    fitted = np.linalg.solve(columns @ columns.T, columns @ signal)
    return complex(fitted[0], fitted[HARMONICS])
