"""Measured modes and the model's as pairs: near in frequency and alike in shape, each of them once."""

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS


def paired(measured_Hz: Array, model_Hz: Array, alike: Array) -> dict[int, int]:
    """Number of the model's mode by that of the measured one, the best pairs first.

    Parameters
    ----------
    measured_Hz, model_Hz : ndarray, (r,), (m,)
    alike : ndarray, (r, m)
        Modal assurance criterion of each with each, one where there is none.
    """
    cost = np.abs(np.log(measured_Hz[:, None] / model_Hz)) / LIMITS.pairing_farthest
    cost = cost + (1 - alike) / LIMITS.pairing_least_mac
    found: dict[int, int] = {}
    while cost.size and np.min(cost) < 1:
        row, column = np.unravel_index(np.argmin(cost), cost.shape)
        found[int(row)] = int(column)
        cost[row], cost[:, column] = np.inf, np.inf
    return found
