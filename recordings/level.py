"""How large the samples of a channel are, taken piece by piece."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import NDArray

from recordings.run import Samples, pieces


@dataclass(kw_only=True)
class Level:
    """How large the samples are that were taken so far; those that are not finite were lost."""

    samples: int = 0
    count: int = 0
    """How many, with the lost ones and without."""
    largest: float = 0.0
    """Size of any."""
    largest_at: int = 0
    """Of all samples, which one that is."""
    _mean: float = 0.0
    _squares: float = 0.0

    @classmethod
    def of(cls, *parts: Samples) -> Level:
        """Of all parts together."""
        found = cls()
        for piece in chain.from_iterable(map(pieces, parts)):
            found.take(piece)
        return found

    @property
    def std(self) -> float:
        """Standard deviation; NaN of no sample."""
        return math.sqrt(self._squares / self.count) if self.count else math.nan

    def take(self, piece: NDArray[Any]) -> None:
        """The next samples."""
        places = np.flatnonzero(np.isfinite(piece))
        if len(places):
            x = piece[places].astype(float)
            at = int(np.argmax(np.abs(x)))
            if abs(x[at]) > self.largest:
                self.largest, self.largest_at = float(abs(x[at])), self.samples + int(places[at])
            mean, count = float(np.mean(x)), self.count + len(x)
            self._squares += float(np.sum((x - mean) ** 2)) + (mean - self._mean) ** 2 * self.count * len(x) / count
            self._mean += (mean - self._mean) * len(x) / count
            self.count = count
        self.samples += len(piece)
