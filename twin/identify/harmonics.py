"""Higher harmonics of the stepped sines: they tell where on the structure a nonlinear force acts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import HARMONICS
from twin.identify.prediction import HarmonicResiduals, Predictor, Unknowns

__all__ = ["harmonic_residuals"]

Array = NDArray[Any]

SIGNATURE_ERROR = 0.04
"""Relative error of the joint's signature: its opening is not quite mode 1's when it softens."""
LINEAR_ERROR = 0.1
"""Relative error of the response to the force's own harmonics, some of which fall near other resonances."""


def harmonic_residuals(predictor: Predictor, unknowns: Unknowns) -> HarmonicResiduals:
    """Harmonics 2 ... 7 of every step less their linear part, with their covariance.

    Parameters
    ----------
    predictor, unknowns
        The fitted base model.
    """
    steps = predictor.evidence.steps
    orders = np.arange(2, HARMONICS + 1)
    linear, joint, field = predictor.harmonic_fields(unknowns, orders)
    measured = np.moveaxis(steps.response[:, :, orders - 1], 1, 2)
    variance = np.moveaxis(steps.response_variance[:, :, orders - 1], 1, 2)
    residual = measured - linear
    outputs = residual.shape[2]
    ratio = linear / np.where(steps.force[:, orders - 1] == 0, 1.0, steps.force[:, orders - 1])[:, :, None]
    known = np.isfinite(variance)
    residual = np.where(known, residual, 0.0)
    covariance = (np.where(known, variance, 1.0) + (LINEAR_ERROR * np.abs(linear)) ** 2)[..., None] * np.eye(outputs)
    force_variance = np.where(np.isfinite(steps.force_variance), steps.force_variance, 0.0)[:, orders - 1]
    covariance = covariance + force_variance[:, :, None, None] * ratio[..., :, None] * np.conj(ratio)[..., None, :]
    odd = (orders % 2 == 1)[None, :, None, None]
    size = np.sum(np.abs(residual) ** 2, axis=2)[..., None, None]
    direction = joint / np.linalg.norm(joint, axis=2, keepdims=True)
    anything = 100.0 * size * direction[..., :, None] * np.conj(direction)[..., None, :]
    tolerance = SIGNATURE_ERROR**2 * size * np.eye(outputs)
    covariance = covariance + odd * (anything + tolerance)
    return HarmonicResiduals(orders, residual, np.linalg.cholesky(covariance), field)
