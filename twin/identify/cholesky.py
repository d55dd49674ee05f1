"""A positive definite matrix, factored once; as accurate however its unknowns are scaled (Demmel 1989)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from twin.arrays import Array


@dataclass(frozen=True)
class Cholesky:
    """Lower factor (n, n) of a matrix.

    Moduli of 1e8 stand beside losses of 1e-3 in one vector of unknowns: elimination by pivots loses some digits there.
    """

    factor: Array

    @classmethod
    def of(cls, matrix: Array) -> Cholesky:
        """From a symmetric matrix (n, n).

        LinAlgError if it is not positive definite.
        """
        return cls(cho_factor(matrix, lower=True, check_finite=False)[0])

    def solve(self, right: Array) -> Array:
        """Inverse times (n, ...)."""
        return np.asarray(cho_solve((self.factor, True), right, check_finite=False))

    @property
    def inverse(self) -> Array:
        """The inverse, (n, n)."""
        return self.solve(np.eye(len(self.factor)))

    @property
    def log_determinant(self) -> float:
        """Of the matrix."""
        return float(2 * np.sum(np.log(np.diag(self.factor))))
