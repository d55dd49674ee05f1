"""Sweeps measured beside two models: the responses step by step, and their errors."""

from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.measured_data import MeasuredData
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

    Harmonic 1 is the fundamental at every step and channel, (s o,); harmonic 2 is there where it :func:`stands_out`,
    less the linear response to the force's own.  Odd harmonics are left out, since the joint's own law makes them in a
    way the model does not predict; so are higher even ones, because they fall near resonances, where a hundredth of the
    frequency decides how large they are.
    """
    steps = evidence.steps
    fundamental = predicted_steps(evidence, model) * steps.force[:, :1] / steps.response[:, :, 0] - 1
    errors = {1: np.abs(fundamental).ravel()}
    out = stands_out(evidence, harmonics)
    if out.any():
        measured = second_harmonic(harmonics, harmonics.residual)
        predicted = second_harmonic(harmonics, predicted_harmonics(evidence, model, harmonics))
        errors[2] = np.abs(predicted[out] / measured[out] - 1)
    return errors


def stands_out(evidence: MeasuredData, harmonics: HarmonicResiduals) -> Array:
    """Where (s, o) the second harmonic is clear of its noise, and so has a relative error to speak of.

    It must also be beyond what the force's own second harmonic, which no model has to predict, could make of it.
    """
    steps = evidence.steps
    residual = second_harmonic(harmonics, harmonics.residual)
    linear = IDENTIFY.linear_error * np.abs(steps.response[:, :, 1] - residual)
    noise = LIMITS.second_harmonic_deviations * _second_noise(evidence, harmonics)
    return np.asarray(np.abs(residual) > np.maximum(noise, linear))


def _second_noise(evidence: MeasuredData, harmonics: HarmonicResiduals) -> Array:
    """Standard deviation (s, o) of the second harmonic less its linear part.

    That part brings the noise of the measured force, and near a resonance far more of it than the response has.
    """
    steps = evidence.steps
    linear = steps.response[:, :, 1] - second_harmonic(harmonics, harmonics.residual)
    force = np.where(steps.force[:, 1] == 0, np.inf, np.abs(steps.force[:, 1]))
    gain = np.abs(linear) / force[:, None]
    force_variance = np.nan_to_num(steps.force_variance[:, 1], nan=0.0)
    return np.asarray(
        np.sqrt(np.nan_to_num(steps.response_variance[:, :, 1], nan=np.inf) + gain**2 * force_variance[:, None])
    )


def noise_floors(evidence: MeasuredData, harmonics: HarmonicResiduals) -> dict[int, Array]:
    """The relative errors that a perfect model would have, as :func:`relative_errors`."""
    steps = evidence.steps
    shared = steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2
    own = steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2
    floors = {1: np.sqrt(own + shared[:, None]).ravel()}
    out = stands_out(evidence, harmonics)
    if out.any():
        measured = np.abs(second_harmonic(harmonics, harmonics.residual))
        floors[2] = _second_noise(evidence, harmonics)[out] / measured[out]
    return floors


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
    noise = np.sqrt(
        steps.response_variance[:, :, 0] / np.abs(steps.response[:, :, 0]) ** 2
        + (steps.force_variance[:, 0] / np.abs(steps.force[:, 0]) ** 2)[:, None]
    )
    sigma = [np.abs(model / measured - 1) / noise for model in (before, after)]
    out = []
    for sweep, pick in steps.by_sweep.items():
        out.append(
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
        )
    return tuple(out)
