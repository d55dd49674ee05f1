"""Residuals in which parameters that are known only so well count as noise: generalised least squares of low rank.

A law of amplitude is fitted on linear parameters from another recording.  They are wrong by a fraction of their own
standard deviations, alike at all steps, and where the noise is small that error would bend the law.  With residuals
``eps = S dx + B delta + noise``, delta of covariance C and noise of variance sigma^2, the covariance of eps is
``sigma^2 (1 + U diag(s^2) U')`` where ``B C^(1/2) / sigma = U diag(s) V'``, and its inverse root shrinks the few
directions U by ``1 / sqrt(1 + s^2)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["UncertainBase"]

Array = NDArray[Any]


@dataclass(frozen=True)
class UncertainBase:
    """Directions of the residuals that wrong base parameters move.

    Attributes
    ----------
    U : ndarray, (r, b)
        Orthonormal.
    shrink : ndarray, (b,)
        What whitening leaves of each.
    per_residual : ndarray, (b, r)
        Expected change of the base parameters from residuals that nothing else explains.
    """

    U: Array
    shrink: Array
    per_residual: Array

    @staticmethod
    def of(by_base: Array, covariance: Array, variance: float) -> UncertainBase:
        """Set up.

        Parameters
        ----------
        by_base : ndarray, (r, b)
            Of the residuals' model.
        covariance : ndarray, (b, b)
            Of the base parameters.
        variance
            Of each residual's noise.
        """
        values, vectors = np.linalg.eigh(covariance)
        root = vectors * np.sqrt(np.maximum(values, 0.0))
        U, s, Vt = np.linalg.svd(by_base @ root, full_matrices=False)
        # Exact parameters beside exact responses leave nothing to share.
        total = s**2 + variance
        shrink = np.sqrt(1 - np.divide(s**2, total, out=np.zeros_like(s), where=total > 0))
        gain = np.divide(s, total, out=np.zeros_like(s), where=total > 0)
        return UncertainBase(U, shrink, (root @ Vt.T * gain) @ U.T)

    def whiten(self, rows: Array) -> Array:
        """Residuals (r,), or a matrix (r, n) of sensitivities, with independent noise of the same variance."""
        along = self.U.T @ rows
        return np.asarray(rows - self.U @ ((1 - self.shrink) * along.T).T)

    def change(self, residual: Array) -> Array:
        """Base parameters' expected change, (b,)."""
        return np.asarray(self.per_residual @ residual)
