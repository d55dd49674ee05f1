"""Higher harmonics of the steps as residuals, and the factors that whiten them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.structure import Structure

Array = NDArray[Any]


@dataclass(frozen=True)
class HarmonicResiduals:
    """Higher harmonics less the linear response to the force's own, and the factors that whiten them.

    Attributes
    ----------
    orders : ndarray, (h,)
    residual : ndarray, (s, h, o)
    cholesky : ndarray, (s, h, o, o)
        Of their covariance: noise, the error of the linear part, and, in odd harmonics, anything at all in the
        direction of the joint's own signature, since the time form of the joint's law is not known beforehand.
    field : ndarray, (s, h, o, n)
        Response of the outputs to unit forces on all degrees of freedom of `structure`.
    structure : Structure
        The model's that they were reduced against: a cause may have given it another mesh than the assumed one.
    """

    orders: Array
    residual: Array
    cholesky: Array
    field: Array
    structure: Structure

    def select(self, keep: Array) -> HarmonicResiduals:
        """The steps where `keep` is true."""
        return replace(
            self,
            residual=self.residual[keep],
            cholesky=self.cholesky[keep],
            field=self.field[keep],
        )

    def whiten(self, values: Array) -> Array:
        """Real whitened values (r,) of complex ones (s, h, o), or (r, u) of (s, h, o, u)."""
        columns = values if values.ndim == 4 else values[..., None]
        white = np.linalg.solve(self.cholesky, columns).reshape(-1, columns.shape[3])
        white = np.sqrt(2.0) * np.concatenate([white.real, white.imag])
        return white if values.ndim == 4 else white[:, 0]
