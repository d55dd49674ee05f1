"""How far apart the values of a channel lie."""

import numpy as np

from recordings.run import Samples, pieces
from twin.arrays import Array

SAMPLES = 200_000


def smallest_step(x: Samples) -> float:
    """The step that almost all differences between neighbouring levels are at least; 0 for a channel that never moves.

    Parameters
    ----------
    x
        Those that are not finite do not count; the first of them are enough.
    """
    first: list[Array] = []
    for piece in pieces(x):
        first.append(piece[np.isfinite(piece)])
        if sum(map(len, first)) >= SAMPLES:
            break
    levels = np.unique(np.concatenate([*first, np.empty(0)])[:SAMPLES].astype(float))
    if len(levels) < 3:
        return 0.0
    return float(np.quantile(np.diff(levels), 0.05))
