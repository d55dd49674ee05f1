"""Sweeps measured beside two models: the responses step by step, and their errors."""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.measured_data import MeasuredData, StepArrays
from twin.identify.residuals.whitening import HarmonicResiduals


@dataclass(frozen=True, kw_only=True)
class SweepComparison:
    """One sweep: measured, as the base family has it (before), and as the extended model has it (after)."""

    run: str
    sweep: str
    """Its name, with the run's where two runs have the same."""
    channels: tuple[str, ...]
    frequency_Hz: Array
    """Array (s,)."""
    force_N: Array
    """Amplitude of the measured force, (s,)."""
    measured: Array
    before: Array
    after: Array
    """Complex fundamental per force, in unit/N, (s, o)."""
    residual_before: Array
    residual_after: Array
    """Magnitude of the fundamental's error in units of its noise, (s, o)."""


def predicted_steps(evidence: MeasuredData, model: FittedModel) -> Array:
    """Predicted fundamentals (s, o) per force; everything moves as far as the reference channel says."""
    residual_model = model.residual_model(evidence)
    R, omega, _ = residual_model.step_receptance(model.baseline, inner=False)
    return residual_model.responses(R, omega)


def predicted_harmonics(evidence: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals) -> Array:
    """What the extension's nonlinear forces add to the higher harmonics, (s, h, o), in the channels' units."""
    residual_model = model.residual_model(evidence, harmonics)
    if not (residual_model.modification.nonlinear or residual_model.modification.opening):
        return np.zeros_like(harmonics.residual)
    R, _, balance = residual_model.step_receptance(model.baseline, inner=False)
    return residual_model.extra_harmonics(model.baseline, R, balance)


def relative_errors(evidence: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals) -> dict[int, Array]:
    """Errors of the complex response relative to itself, by harmonic.

    Harmonic 1 is the fundamental at every step and channel, (s o,); harmonic 2 is there where it stands out, see
    :func:`measured_second`, less the linear response to the force's own.  Odd harmonics are left out, since the joint's
    own law makes them in a way the model does not predict; so are higher even ones, because they fall near resonances,
    where a hundredth of the frequency decides how large they are.
    """
    steps = evidence.steps
    fundamental = predicted_steps(evidence, model) * steps.force[:, :1] / steps.response[:, :, 0] - 1
    errors = {1: np.abs(fundamental).ravel()}
    measured, _, out = measured_second(evidence, harmonics)
    if out.any():
        predicted = second_harmonic(harmonics, predicted_harmonics(evidence, model, harmonics))
        errors[2] = np.abs(predicted[out] / measured[out] - 1)
    return errors


def measured_second(evidence: MeasuredData, harmonics: HarmonicResiduals) -> tuple[Array, Array, Array]:
    """The second harmonic (s, o) less its linear part, its standard deviation, and where it stands out.

    The linear part brings the noise of the measured force, and near a resonance far more of it than the response has.
    Where the rest is clear of its noise it has a relative error to speak of; but it must also be beyond what the
    force's own second harmonic, which no model has to predict, could make of it.
    """
    steps, measured = evidence.steps, second_harmonic(harmonics, harmonics.residual)
    linear = np.abs(steps.response[:, :, 1] - measured)
    gain = linear / np.where(steps.force[:, 1] == 0, np.inf, np.abs(steps.force[:, 1]))[:, None]
    own = np.nan_to_num(steps.response_variance[:, :, 1], nan=np.inf)
    noise = np.sqrt(own + gain**2 * np.nan_to_num(steps.force_variance[:, 1], nan=0.0)[:, None])
    least = np.maximum(LIMITS.second_harmonic_deviations * noise, IDENTIFY.linear_error * linear)
    return measured, noise, np.abs(measured) > least


def noise_floors(evidence: MeasuredData, harmonics: HarmonicResiduals) -> dict[int, Array]:
    """The relative errors that a perfect model would have, as :func:`relative_errors`."""
    floors = {1: _noise_of_fundamentals(evidence.steps).ravel()}
    measured, noise, out = measured_second(evidence, harmonics)
    if out.any():
        floors[2] = noise[out] / np.abs(measured[out])
    return floors


def _noise_of_fundamentals(steps: StepArrays) -> Array:
    """Relative standard deviation (s, o) of each response per force."""
    shared = steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2
    own = steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2
    return np.asarray(np.sqrt(own + shared[:, None]))


def second_harmonic(harmonics: HarmonicResiduals, values: Array) -> Array:
    """The second harmonic (s, o, ...) of values (s, h, o, ...)."""
    return np.asarray(values[:, harmonics.orders == 2][:, 0])


def compare_sweeps(evidence: MeasuredData, before: FittedModel, after: FittedModel) -> tuple[SweepComparison, ...]:
    """Every sweep of the evidence beside both models."""
    return sweeps_beside(evidence, predicted_steps(evidence, before), predicted_steps(evidence, after))


def sweeps_beside(evidence: MeasuredData, before: Array, after: Array) -> tuple[SweepComparison, ...]:
    """Every sweep of the evidence beside what two models predict of its steps, (s, o) each."""
    steps = evidence.steps
    measured = steps.response[:, :, 0] / steps.force[:, :1]
    noise = _noise_of_fundamentals(steps)
    sigma = [np.abs(model / measured - 1) / noise for model in (before, after)]
    return tuple(
        SweepComparison(
            run=steps.states[pick[0]].run,
            sweep=sweep,
            channels=evidence.channels,
            frequency_Hz=steps.omega[pick] / (2 * np.pi),
            force_N=np.abs(steps.force[pick, 0]),
            measured=measured[pick],
            before=before[pick],
            after=after[pick],
            residual_before=sigma[0][pick],
            residual_after=sigma[1][pick],
        )
        for sweep, pick in steps.by_sweep.items()
    )
