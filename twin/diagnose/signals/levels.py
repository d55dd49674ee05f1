"""How far apart the values of a channel lie."""

import math
from dataclasses import dataclass
from itertools import chain

import numpy as np

from recordings.run import Samples, pieces
from twin.arrays import Array

SAMPLES = 200_000


@dataclass(frozen=True)
class Level:
    """How many samples of a channel are finite, their standard deviation, and the largest size."""

    count: int
    std: float
    largest: float

    @staticmethod
    def of(*parts: Samples) -> "Level":
        """Piece by piece, of all parts together."""
        count, mean, squares, largest = 0, 0.0, 0.0, 0.0
        for piece in chain.from_iterable(map(pieces, parts)):
            known = piece[np.isfinite(piece)].astype(float)
            if not len(known):
                continue
            own, every = float(np.mean(known)), count + len(known)
            apart = own - mean
            squares += float(np.sum((known - own) ** 2)) + apart**2 * count * len(known) / every
            mean, count = mean + apart * len(known) / every, every
            largest = float(np.max(np.abs(known), initial=largest))
        return Level(count, math.sqrt(squares / count) if count else 0.0, largest)


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
