"""What a model leaves of the data, and how that changes with its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array

Columns = list[tuple[slice | int, Array]]
"""Columns of a block's sensitivities, and which of the unknowns' they are; those to the others are nothing."""


@dataclass(frozen=True)
class Prediction:
    """Whitened residual and sensitivities."""

    residual: Array
    """Measured minus predicted in units of its standard deviation; real and imaginary parts, (r,)."""
    jacobian: Array
    """d(predicted) / d(unknowns), whitened alike, (r, u)."""
    blocks: tuple[tuple[str, slice], ...]
    """Parts of the residual: each broadband run, the steps' fundamentals, their harmonics."""

    @classmethod
    def of(cls, blocks: Sequence[tuple[str, tuple[Array, Columns]]], unknowns: int) -> Prediction:
        """From each block's name, residual and sensitivities."""
        ends = np.cumsum([0, *(len(residual) for _, (residual, _) in blocks)]).tolist()
        jacobian = np.zeros((ends[-1], unknowns))
        named = tuple((name, slice(*ends[n : n + 2])) for n, (name, _) in enumerate(blocks))
        for (_, rows), (_, (_, columns)) in zip(named, blocks, strict=True):
            for which, values in columns:
                jacobian[rows, which] = values
        return cls(np.concatenate([residual for _, (residual, _) in blocks]), jacobian, named)

    @property
    def chi2(self) -> float:
        """Sum of squares."""
        return float(self.residual @ self.residual)
