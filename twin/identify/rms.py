"""The size of many errors as one number."""

import numpy as np
from numpy.typing import ArrayLike

from twin.arrays import Array


def rms(values: ArrayLike) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))


def relative_error_percent(predicted: Array, measured: Array) -> float:
    """Root-mean-square relative error of complex responses, per cent."""
    return float(100 * np.sqrt(np.mean(np.abs(predicted / measured - 1) ** 2)))
