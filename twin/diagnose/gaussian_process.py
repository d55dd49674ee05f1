"""Smooth functions as a few columns with standard normal amounts."""

import numpy as np

from twin.arrays import Array
from twin.diagnose.limits import LIMITS


def smooth_columns(coordinates: Array) -> Array:
    """Columns (n, k) of a Gaussian process of unit variance at n points (n, d), with a correlation length of one.

    Those are left out whose variance is next to nothing (Rasmussen and Williams 2006, section 2.1 and equation 4.9).
    """
    apart = coordinates[:, None] - coordinates
    variance, shape = np.linalg.eigh(np.exp(-0.5 * np.sum(apart**2, axis=2)))
    felt = variance > LIMITS.gaussian_process_felt
    return np.asarray(shape[:, felt] * np.sqrt(variance[felt]))
