"""Fourier coefficients of the overshoot (a cos t - gap) above a gap, for one-sided contacts and openings."""

from typing import Any

import numpy as np
from numpy.typing import NDArray


def one_sided_harmonics(amplitude: NDArray[Any], gap: float, count: int) -> NDArray[Any]:
    """Cosine coefficients 1 ... count of max(a cos t - gap, 0), in closed form.

    Contact lasts from -t0 to t0 with cos t0 = gap / a.  With s_n = sin(n t0) / n (t0 for n = 0), coefficient h is
    (a (s_(h-1) + s_(h+1)) - 2 gap s_h) / pi.

    Returns
    -------
    ndarray, (len(amplitude), count)
    """
    a = np.asarray(amplitude, float)
    t0 = np.arccos(np.clip(gap / np.maximum(a, 1e-300), -1.0, 1.0))
    n = np.arange(count + 2)
    s = np.where(n == 0, t0[:, None], np.sin(n * t0[:, None]) / np.maximum(n, 1))
    h = np.arange(1, count + 1)
    return np.asarray((a[:, None] * (s[:, h - 1] + s[:, h + 1]) - 2 * gap * s[:, h]) / np.pi, complex)
