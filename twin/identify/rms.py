"""The size of many errors as one number."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

__all__ = ["rms"]


def rms(values: ArrayLike) -> float:
    """Root mean square."""
    return float(np.sqrt(np.mean(np.square(values))))
