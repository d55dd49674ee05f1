"""What the channels answer in a broadband run, with what local nonlinear forces do in its noise."""

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.forward_model import ForwardModel
from twin.identify.linear.structural_modification import attach
from twin.identify.model_modification import NoiseMotion
from twin.identify.spectra.broadband import BinnedResponse


def broadband_response(model: ForwardModel, data: BinnedResponse, baseline: BaselineParameters) -> Array:
    """Predicted responses per force (b, o) at the bins of a broadband run, unit/N."""
    R, omega = felt_receptance(model, data, baseline, inner=len(baseline.shown) > 0)
    H = model.responses(R, omega)
    return H * np.exp(log_response_by_shown(model, R, omega) @ baseline.shown) if len(baseline.shown) else H


def log_response_by_shown(model: ForwardModel, R: Array, omega: Array) -> Array:
    """D log response (f, o, o m) / d log of what each of the outputs shows of each of the m damped modes."""
    return model.log_response_change(model.model.shown_sensitivity(model.driven(R, omega)), R, omega)


def felt_receptance(
    model: ForwardModel, data: BinnedResponse, baseline: BaselineParameters, *, inner: bool = False
) -> tuple[Array, Array]:
    """Receptances of a broadband run with what local nonlinear forces do in its noise; and the rig's own omega."""
    R, omega = model.broadband_receptance(data, baseline, data.omega, inner=inner)
    if model.local.act_in_noise:
        R = in_noise(model, R, omega, noise_motion(model, R, omega, data, model.nonlinear_ports))
    return R, omega


def noise_motion(
    model: ForwardModel, R: Array, omega: Array, data: BinnedResponse, ports: slice | NDArray[np.intp]
) -> tuple[NoiseMotion, ...]:
    """How some ports move in a broadband run.

    As with steps, the motion is that of the measured channels, carried to the ports by the model's shapes.
    """
    H = model.responses(R, omega)
    measured = np.sum(np.conj(H) * data.H, axis=1) / np.sum(np.abs(H) ** 2, axis=1)
    motion = model.driven(R, omega)[:, ports] * measured[:, None]
    power = np.abs(motion) ** 2 * data.force_power[:, None]
    return tuple(NoiseMotion(omega, column) for column in power.T)


def in_noise(model: ForwardModel, R: Array, omega: Array, motion: tuple[NoiseMotion, ...]) -> Array:
    """Receptances with the linear substitutes of the local nonlinear forces at this :func:`noise_motion`."""
    return attach(R, model.nonlinear_ports, model.local.substitutes(motion, omega))
