"""From pieces that arrive, late, twice or never, to contiguous samples and an account of what was lost."""

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

CAPACITY = 1 << 18
"""Samples kept at most; a jump of the index beyond it is taken as a loss at once."""


@dataclass(frozen=True)
class Piece:
    """Samples `first_index` .. of all channels, shape (channels, n); none at all if they were lost."""

    first_index: int
    count: int
    values: NDArray[np.float32] | None


class Reassembler:
    """Puts pieces of a device's channels in order.

    Parameters
    ----------
    channels
        How many.
    tolerance
        Samples by which a piece may be late; what is older than the newest sample by more is given up.

    Attributes
    ----------
    repeated
        Samples that came twice or after they had been given up, and were not used.
    late
        Samples that came after later ones of their channel, and were put in their place.
    """

    def __init__(self, channels: int, *, tolerance: int) -> None:
        self._tolerance = tolerance
        self._values = np.empty((channels, 4096), np.float32)
        self._have = np.zeros((channels, 4096), bool)
        self._base = 0
        self._front = [0] * channels  # everything before it has come
        self._reach = [0] * channels  # one past the newest that has come
        self._high = 0
        self._early: list[Piece] = []
        self.repeated = 0
        self.late = 0

    @property
    def base(self) -> int:
        """The first sample not yet taken."""
        return self._base

    @property
    def high(self) -> int:
        """One past the newest sample seen."""
        return self._high

    @property
    def ready(self) -> int:
        """Everything before this sample has come or is given up."""
        return max(min(self._front), self._high - self._tolerance, self._base)

    def put(self, rows: slice, first_index: int, values: NDArray[np.float32]) -> bool:
        """Take samples of some channels, shape (rows, n); whether any of them was new."""
        skip = max(0, self._base - first_index)
        count = values.shape[1]
        if skip >= count:
            self.repeated += count
            return False
        start = first_index + skip - self._base
        stop = first_index + count - self._base
        if stop > CAPACITY:
            self._jump(first_index)
            start, stop = 0, count
        if stop > self._values.shape[1]:
            self._grow(stop)
        have = self._have[rows, start:stop]
        twice = int(have[0].sum()) if self._high > first_index + skip else 0
        self.repeated += skip + twice
        if first_index + count <= min(self._reach[rows]):
            self.late += count - skip - twice
        self._values[rows, start:stop] = values[:, skip:]
        have[:] = True
        behind = self._high - self._base
        for row in range(*rows.indices(len(self._front))):
            self._reach[row] = max(self._reach[row], first_index + count)
            if start <= self._front[row] - self._base < stop:
                front = stop
                if stop < behind:  # what came early may follow
                    missing = np.flatnonzero(~self._have[row, stop:behind])
                    front = stop + int(missing[0]) if len(missing) else behind
                self._front[row] = self._base + front
        self._high = max(self._high, first_index + count)
        return twice < count - skip

    def _grow(self, columns: int) -> None:
        size = min(CAPACITY, max(columns, 2 * self._values.shape[1]))
        add = size - self._values.shape[1]
        self._values = np.pad(self._values, ((0, 0), (0, add)))
        self._have = np.pad(self._have, ((0, 0), (0, add)))

    def _jump(self, index: int) -> None:
        """Give everything up that is before a sample, and go on there."""
        self._early += self.take(self._high)
        self._early.append(Piece(self._base, index - self._base, None))
        self._base = self._high = index
        self._front = [index] * len(self._front)

    def take(self, stop: int) -> list[Piece]:
        """Hand out what is before sample `stop`, in order, with what is missing."""
        early, self._early = self._early, []
        count = min(stop, self._base + self._values.shape[1]) - self._base
        if count <= 0:
            return early
        pieces = early + self._cut(count)
        kept = max(0, self._high - self._base - count)
        # Move what remains to the front: short, as blocks are taken as soon as they are whole.
        self._values[:, :kept] = self._values[:, count : count + kept].copy()
        self._have[:, :kept] = self._have[:, count : count + kept].copy()
        self._have[:, kept : kept + count] = False
        self._base += count
        self._high = max(self._high, self._base)
        for row, front in enumerate(self._front):
            if front < self._base:
                missing = np.flatnonzero(~self._have[row, :kept])
                self._front[row] = self._base + (int(missing[0]) if len(missing) else kept)
        return pieces

    def _cut(self, count: int) -> list[Piece]:
        if min(self._front) >= self._base + count:
            return [Piece(self._base, count, self._values[:, :count].copy())]
        whole: NDArray[np.bool_] = np.all(self._have[:, :count], axis=0)
        edges = [0, *(np.flatnonzero(np.diff(whole)) + 1).tolist(), count]
        return [
            Piece(self._base + a, b - a, self._values[:, a:b].copy() if whole[a] else None) for a, b in pairwise(edges)
        ]
