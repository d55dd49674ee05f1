"""What a procedure would bring if a model were true: its prediction, with the noise that the recordings showed."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from twin.arrays import Array
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.next_test.limits import LIMITS
from twin.diagnose.next_test.predicted_noise import predicted_bins
from twin.diagnose.next_test.proposal import Proposal
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.measured_data import MeasuredData, StepArrays
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.spectra.broadband import BinnedResponse
from twin.identify.spectra.resonances import same_resonance
from twin.procedures import Random, SteppedSine


@dataclass(frozen=True)
class PredictedData:
    """Measured data that a procedure would bring if a model were true."""

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None
    left: Array
    """Array (r,). Whitened residual of the true model: what no model explains of the joint's own harmonics."""

    @classmethod
    def beside(cls, evidence: MeasuredData, harmonics: HarmonicResiduals | None, truth: FittedModel) -> Self:
        """With what the model leaves of them."""
        left = truth.residual_model(evidence, harmonics).evaluate(truth.baseline, sensitivities=False).residual
        return cls(evidence, harmonics, left)


def predict_test_data(evidence: MeasuredData, truth: FittedModel, proposal: Proposal) -> PredictedData:
    """What a proposal would record.

    Parameters
    ----------
    evidence
        What was recorded: its noise, forces, and settling are those of the new test.
    """
    last = max([s.time_s for s in evidence.steps.states] + [d.time_s for d in evidence.broadband])
    procedure = proposal.procedure
    if isinstance(procedure, Random):
        middle = last + proposal.rig_time_s / 2
        if evidence.broadband:
            data = _noise(evidence, procedure, proposal.longer, middle)
        else:
            data = predicted_bins(evidence, truth, procedure, middle)
        data = _answered(evidence, truth, data)
        return PredictedData.beside(replace(evidence.without_steps(), broadband=(data,)), None, truth)
    assert isinstance(procedure, SteppedSine)
    steps = _steps(evidence, truth, procedure, proposal, last)
    predicted_data = replace(evidence, broadband=(), steps=steps)
    harmonics = harmonic_residuals(ResidualModel(predicted_data), truth.baseline)
    return PredictedData.beside(predicted_data, harmonics, truth)


def _noise(evidence: MeasuredData, procedure: Random, longer: float, time_s: float) -> BinnedResponse:
    """Bins within the band, the force's power spread over it, each with less noise the more power and time it gets."""
    data = evidence.broadband[0]
    f = data.frequency_Hz
    inside = (f >= procedure.band[0]) & (f <= procedure.band[1])
    louder = procedure.rms**2 / float(data.force_power[inside].sum())
    # Distortion grows with the motion, which keeps its rms; white noise does not.
    scatter = np.maximum(data.distortion[inside], 1.0)
    less = (1 / louder + (scatter - 1)) / scatter / longer
    return replace(
        data,
        time_s=time_s,
        frequency_Hz=f[inside],
        H=data.H[inside],
        relative_covariance=data.relative_covariance[inside] * less[:, None, None],
        distortion=data.distortion[inside],
        force_power=data.force_power[inside] * louder,
    )


def _answered(evidence: MeasuredData, truth: FittedModel, band: BinnedResponse) -> BinnedResponse:
    """The bins with what the model answers."""
    there = truth.residual_model(replace(evidence.without_steps(), broadband=(band,)))
    return replace(band, H=broadband_response(there, band, truth.baseline))


def _steps(
    evidence: MeasuredData, truth: FittedModel, procedure: SteppedSine, proposal: Proposal, last_s: float
) -> StepArrays:
    """The sweep's steps at the amplitudes that the model has at this force, beside the nearest ones recorded."""
    frequencies = np.array(procedure.frequencies)
    if procedure.direction == "both":
        frequencies = np.concatenate([frequencies, frequencies[::-1]])
    (force,) = procedure.amplitudes
    omega = 2 * np.pi * frequencies
    each = proposal.rig_time_s / len(omega)
    time = last_s + each * (1 + np.arange(len(omega)))
    X = _amplitudes(evidence, truth, omega, force, time)
    nearest = _nearest(evidence.steps, omega, X)
    shape = _shape(evidence, nearest, omega, X, force, time, proposal.longer)
    residual_model = truth.residual_model(replace(evidence, broadband=(), steps=shape))
    R, driven, balance = residual_model.step_receptance(truth.baseline, inner=False)
    response = shape.response.copy()
    response[:, :, 0] = residual_model.responses(R, driven) * shape.force[:, :1]
    moved = replace(shape, response=response)
    if residual_model.modification.nonlinear or residual_model.modification.opening:
        there = replace(evidence, broadband=(), steps=moved)
        residuals = harmonic_residuals(ResidualModel(there), truth.baseline)
        extra = truth.residual_model(there, residuals).extra_harmonics(truth.baseline, R, balance)
        response[:, :, residuals.orders - 1] += np.moveaxis(extra, 1, 2)
        moved = replace(moved, response=response)
    return moved


def _amplitudes(evidence: MeasuredData, truth: FittedModel, omega: Array, force: float, time: Array) -> Array:
    """Amplitudes X (s,) of the reference channel, m, at this force: the branch that a sweep in this order stays on."""
    known = evidence.steps.amplitude_m
    grid = np.geomspace(
        LIMITS.amplitude_range[0] * known.min(), LIMITS.amplitude_range[1] * known.max(), LIMITS.law_points
    )
    count = len(omega)
    all_omega, all_X = np.repeat(omega, LIMITS.law_points), np.tile(grid, count)
    nearest = _nearest(evidence.steps, all_omega, all_X)
    shape = _shape(evidence, nearest, all_omega, all_X, force, np.repeat(time, LIMITS.law_points), 1.0)
    reference = evidence.reference
    per_X = all_omega ** evidence.outputs[reference].derivative
    response = shape.response.copy()
    response[:, reference, 0] = all_X * per_X
    shape = replace(shape, response=response)
    residual_model = truth.residual_model(replace(evidence, broadband=(), steps=shape))
    R, driven, _ = residual_model.step_receptance(truth.baseline, inner=False)
    gain = np.abs(residual_model.responses(R, driven)[:, reference])
    needed = (all_X * per_X / gain).reshape(count, LIMITS.law_points)
    return _follow(np.log(grid), np.log(needed), np.log(force))


def _follow(log_X: Array, log_force: Array, wanted: float) -> Array:
    """Amplitudes at which each row's force is the one wanted; of several, the nearest to the step before."""
    found = np.zeros(len(log_force))
    before = log_X[0]
    for k, row in enumerate(log_force):
        above = row - wanted
        crossing = np.flatnonzero(above[:-1] * above[1:] <= 0)
        if len(crossing):
            places = log_X[crossing] + np.diff(log_X)[crossing] * above[crossing] / (
                above[crossing] - above[crossing + 1]
            )
            before = places[np.argmin(np.abs(places - before))]
        else:
            before = log_X[-1] if above[-1] < 0 else log_X[0]
        found[k] = before
    return np.exp(found)


def _nearest(steps: StepArrays, omega: Array, X: Array) -> Array:
    """For each step the recorded one that resembles it most in frequency and amplitude."""
    width = max(np.ptp(np.log(steps.omega)), 1e-6)
    spread = max(np.ptp(np.log(steps.amplitude_m)), 1e-6)
    far = ((np.log(omega)[:, None] - np.log(steps.omega)) / width) ** 2
    far = far + ((np.log(X)[:, None] - np.log(steps.amplitude_m)) / spread) ** 2
    return np.argmin(far, axis=1)


def _shape(
    evidence: MeasuredData, nearest: Array, omega: Array, X: Array, force: float, time: Array, longer: float
) -> StepArrays:
    """Steps of a pure force with the nearest recorded ones' noise, and with the odd harmonics of their joint.

    Even harmonics are left to the model: on a sound rig there are none.  Nor is anything known of those about another
    resonance.
    """
    steps = evidence.steps
    # X is a displacement, whatever the channels measure.
    faster = (omega / steps.omega[nearest])[:, None] ** [output.derivative for output in evidence.outputs]
    own = steps.response[nearest] * ((X / steps.amplitude_m[nearest])[:, None] * faster)[:, :, None]
    order = np.arange(own.shape[2])
    same = same_resonance(omega, steps.omega[nearest])
    response = np.where((order % 2 == 0) & (same[:, None, None] | (order == 0)), own, 0.0)
    turn = np.exp(-1j * np.angle(steps.force[nearest, 0]))
    response = response * turn[:, None, None] ** (1 + np.arange(own.shape[2]))
    pure = np.zeros((len(omega), steps.force.shape[1]), complex)
    pure[:, 0] = force
    return StepArrays(
        omega=omega,
        force=pure,
        force_variance=steps.force_variance[nearest] / longer,
        response=response,
        response_variance=steps.response_variance[nearest] / longer,
        amplitude_m=X,
        time_s=time,
        growth=np.zeros(len(omega)),
        growth_std=steps.growth_std[nearest] / longer**1.5,
        states=tuple(steps.states[i] for i in nearest),
    )
