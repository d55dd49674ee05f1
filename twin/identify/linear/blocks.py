"""Named blocks of unknowns in one vector: a fit works on the vector, everything else asks for a block by its name."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twin.arrays import Array


@dataclass(frozen=True)
class Blocks:
    """The order and the sizes of the blocks."""

    sizes: tuple[tuple[str, int], ...]
    """Name and number of entries of each, in the vector's order."""

    @cached_property
    def _slices(self) -> dict[str, slice]:
        found, first = {}, 0
        for name, size in self.sizes:
            found[name] = slice(first, first + size)
            first += size
        return found

    def __len__(self) -> int:
        """Number of entries of the vector."""
        return sum(size for _, size in self.sizes)

    def __getitem__(self, name: str) -> slice:
        """Where a block is."""
        return self._slices[name]

    def pack(self, values: Mapping[str, Array | float]) -> Array:
        """The vector of all blocks; a number stands for a whole block of it."""
        return np.concatenate([np.broadcast_to(np.asarray(values[name], float), size) for name, size in self.sizes])

    def unpack(self, vector: Array) -> dict[str, Array]:
        """Each block's part of a vector."""
        return {name: vector[where] for name, where in self._slices.items()}
