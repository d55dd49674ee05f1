"""Covariances of measured steps and harmonics, as the factors that whiten their residuals."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.measured_data import StepArrays
from twin.structure import Structure

__all__ = ["COMMON_ERROR", "LAW_ERROR", "RATIO_ERROR", "HarmonicResiduals", "step_factor"]

Array = NDArray[Any]

COMMON_ERROR, RATIO_ERROR = 8e-4, 5e-4
"""Relative model error of a response that all channels share, and of their ratio: discretisation and truncation."""
LAW_ERROR, EVEN_LAW_ERROR = 1e-3, 0.5
"""Relative error of the law at a step, since it is a function of one amplitude and the layer's strains are a field;
and, for each unit of the response's even harmonics over its fundamental, how much more."""


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


def step_factor(steps: StepArrays, by_law: Sequence[Array], error_scale: float) -> Array:
    """Cholesky factors of the covariance of the steps' log residuals, real parts above imaginary ones.

    Noise, the force's noise and what had not settled, which all channels share, model error, and the law's own error.

    Parameters
    ----------
    by_law : sequence of ndarray, (s, o)
        Change of the log responses by a unit relative change of each softening and each loss.
    error_scale
        Factor on the model error.

    Returns
    -------
    ndarray, (s, 2 o, 2 o)
    """
    count, outputs = steps.response.shape[:2]
    relative = steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2
    shared = (
        steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2
        + steps.unsettled**2
        + (error_scale * COMMON_ERROR) ** 2
    )
    circular = shared[:, None, None] + (relative + (error_scale * RATIO_ERROR) ** 2)[:, :, None] * np.eye(outputs)
    covariance = np.zeros((count, 2 * outputs, 2 * outputs))
    covariance[:, :outputs, :outputs] = covariance[:, outputs:, outputs:] = circular / 2
    # Even harmonics come of a joint that opens on one side: its law at the fundamental then heeds more than amplitude.
    even = np.nan_to_num(np.abs(steps.response[:, :, 1::2] / steps.response[:, :, :1]))
    law_error = np.hypot(LAW_ERROR, EVEN_LAW_ERROR * np.sqrt(np.sum(even**2, axis=2).mean(axis=1)))[:, None]
    for change in by_law:
        error = law_error * np.concatenate([change.real, change.imag], axis=1)
        covariance += error[:, :, None] * error[:, None, :]
    return np.asarray(np.linalg.cholesky(covariance))
