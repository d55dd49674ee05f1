"""Higher harmonics of the stepped sines: they tell where on the structure a nonlinear force acts."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import HARMONICS
from twin.identify.prediction import Predictor
from twin.identify.unknowns import Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = ["LINEAR_ERROR", "harmonic_fields", "harmonic_residuals", "opening_compliance"]

Array = NDArray[Any]

SIGNATURE_ERROR = 0.04
"""Relative error of the joint's signature: its opening is not quite mode 1's when it softens."""
EVEN_ERROR = 0.15
"""Relative error of any model of the even harmonics: one coordinate stands for the joint."""
RESONANCE_ERROR = 0.01
"""Relative error of the higher natural frequencies at large amplitudes: it matters to harmonics that fall near them."""
BALANCED = 13
"""Harmonics of the opening that are balanced: those beyond the measured ones still move them."""
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
    linear, joint, field = harmonic_fields(predictor, unknowns, orders)
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
    size = np.sum(np.abs(residual) ** 2, axis=2)
    direction = joint / np.linalg.norm(joint, axis=2, keepdims=True)
    anything = 100.0 * size[..., None, None] * direction[..., :, None] * np.conj(direction)[..., None, :]
    even = _even_error(predictor, unknowns, orders, joint, size)
    tolerance = np.where(odd, SIGNATURE_ERROR**2 * size[..., None, None], even[..., None, None]) * np.eye(outputs)
    covariance = covariance + odd * anything + tolerance
    return HarmonicResiduals(
        orders,
        residual,
        np.linalg.cholesky(covariance),
        field,
        opening_compliance(predictor, unknowns),
        predictor.model.structure,
    )


def harmonic_fields(
    predictor: Predictor, unknowns: Unknowns, orders: Array, *, stretch: float = 1.0
) -> tuple[Array, Array, Array]:
    """Responses at multiples of the drive frequency, all frequencies times `stretch`.

    Returns
    -------
    linear : ndarray, (s, h, o)
        Response to the measured force harmonics.
    joint : ndarray, (s, h, o)
        Response to a unit force on the layer's opening in the shape of mode 1: what the joint's law adds.
    field : ndarray, (s, h, o, n)
        Response of each output to a unit force on every degree of freedom.
    """
    steps, model = predictor.evidence.steps, predictor.model
    p = model.ports
    time = steps.time_s - predictor.evidence.origin_s
    dE, dG = predictor.moduli_changes(unknowns, predictor.amplitude_m, time)
    first = stretch * predictor.clock(steps.omega, time)
    opening = p.rows[p.normal] @ model.basis.Phi[:, 0]
    linear, joint, field = [], [], []
    for h in orders:
        omega = h * first
        R = predictor.receptance(omega, unknowns.base, dE, dG)
        factor = model.to_quantity(omega) * predictor.channel_factors(omega)[0]
        linear.append(predictor.responses(R, omega) * steps.force[:, h - 1, None])
        joint.append((R[:, p.outputs, p.normal] @ opening) * factor)
        field.append(model.output_field(omega, unknowns.base, dE, dG) * factor[:, :, None])
    return np.stack(linear, axis=1), np.stack(joint, axis=1), np.stack(field, axis=1)


def opening_compliance(predictor: Predictor, unknowns: Unknowns) -> Array:
    """Opening (s, 1 + BALANCED) at multiples 0, 1 ... of the drive frequency by a unit force on it.

    The force and the opening are in the shape of mode 1, and the result is in units of the layer's linear stiffness;
    the layer has its secant stiffness at each step's amplitude.
    """
    steps, model = predictor.evidence.steps, predictor.model
    time = steps.time_s - predictor.evidence.origin_s
    dE, dG = predictor.moduli_changes(unknowns, predictor.amplitude_m, time)
    opening = model.ports.rows[model.ports.normal] @ model.basis.Phi[:, 0]
    opening = opening / np.linalg.norm(opening)
    out = []
    for h in range(BALANCED + 1):
        R = predictor.receptance(h * predictor.clock(steps.omega, time), unknowns.base, dE, dG)
        out.append(np.einsum("a,sab,b->s", opening, R[:, model.ports.normal, model.ports.normal], opening))
    return np.asarray(model.reference_E * np.stack(out, axis=1))


def _even_error(predictor: Predictor, unknowns: Unknowns, orders: Array, joint: Array, size: Array) -> Array:
    """Variance (s, h) of any model of the even harmonics.

    It is relative to what was measured or, where that is larger, to what a joint force as large as the second
    harmonic's would do: near a resonance a small error of frequency makes a large harmonic small.  The relative error
    grows with the softening, since causes are linear beside it.
    """
    beside = harmonic_fields(predictor, unknowns, orders, stretch=1 + RESONANCE_ERROR)[1]
    gain, gain_beside = (np.sum(np.abs(values) ** 2, axis=2) for values in (joint, beside))
    likely = np.maximum(size, size[:, :1] / gain[:, :1] * np.maximum(gain, gain_beside))
    steps = predictor.evidence.steps
    softened = np.abs(predictor.moduli_changes(unknowns, predictor.amplitude_m, 0.0 * steps.time_s)[0].real)
    softened = softened / unknowns.base.E
    detuned = np.sum(np.abs(beside - joint) ** 2, axis=2) / np.minimum(gain, gain_beside)
    return np.asarray((EVEN_ERROR**2 + softened[:, None] ** 2 + detuned) * likely)
