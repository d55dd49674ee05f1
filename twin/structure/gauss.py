"""Gauss-Legendre quadrature on an element."""

from functools import cache

import numpy as np
from numpy.typing import NDArray


@cache
def gauss(points: int) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Abscissae and weights on 0..1."""
    x, w = np.polynomial.legendre.leggauss(points)
    return (x + 1) / 2, w / 2
