"""How far apart the values of a channel lie."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLES = 200_000


def smallest_step(x: NDArray[Any]) -> float:
    """The step that almost all differences between neighbouring levels are at least; 0 for a channel that never moves.

    Parameters
    ----------
    x : ndarray
        Samples; those that are not finite do not count.
    """
    levels = np.unique(x[np.isfinite(x)][:SAMPLES].astype(float))
    if len(levels) < 3:
        return 0.0
    return float(np.quantile(np.diff(levels), 0.05))
