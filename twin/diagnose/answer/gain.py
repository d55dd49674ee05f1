"""What an extension gains on what no fit has seen, and what the model of a sound rig would leave there."""

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.diagnose.answer.comparison import measured_second, noise_floors, relative_errors, second_harmonic
from twin.diagnose.answer.misfit import HeldOut
from twin.diagnose.fit_problem import FitProblem
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.cholesky import Cholesky
from twin.identify.frequency_shifts import swept_modes
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.error_model import OF_SOFTENING, SOUND
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.likelihood import sound_errors
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.rms import rms

LearntFrom = tuple[MeasuredData, HarmonicResiduals | None]
"""The recordings that a model was fitted to, and their higher harmonics."""


@dataclass(frozen=True)
class HeldOutError:
    """Root-mean-square relative errors over held-out steps, and what a perfect model would leave."""

    before: float
    after: float
    noise_floor: float
    count: int = field(kw_only=True)


@dataclass(frozen=True)
class Gain(HeldOut):
    """Errors of the complex response over held-out steps.

    The response is the fundamental and, where it stands out of its noise, the second harmonic: each error is relative
    to its own harmonic, and all count alike.  In deviations, what is left open of a step counts for so much less there.
    """

    by_harmonic: dict[int, HeldOutError] = field(kw_only=True)
    """The same of each harmonic alone."""
    expected: float = field(kw_only=True)
    """What a right model leaves: noise, the model error that sound rigs have, and what the data leave open of its
    parameters, as of the joint's law between the amplitudes that were learnt from."""


def measure_gain(
    learnt: LearntFrom, unseen: MeasuredData, before: FittedModel, after: FittedModel, *, runs: tuple[str, ...],
    sweeps: tuple[str, ...],
) -> Gain:  # fmt: skip
    """The gain over all steps that were held out.

    Parameters
    ----------
    learnt
        What `after` was fitted to.
    unseen
        What was held out.
    runs, sweeps
        What these are called.
    """
    models = elsewhere(before), elsewhere(after)
    harmonics = harmonic_residuals(ResidualModel(unseen), models[0].baseline)
    errors = [relative_errors(unseen, model, harmonics) for model in models]
    floors = noise_floors(unseen, harmonics)
    of_fundamentals, left_open = _of_a_right_model(learnt, unseen, after, harmonics)
    sound = floors | {1: of_fundamentals}
    right = {harmonic: np.hypot(sound[harmonic], left_open[harmonic]) for harmonic in floors}
    whole = [np.concatenate(list(column.values())) for column in (*errors, floors)]
    known = np.concatenate([sound[harmonic] / right[harmonic] for harmonic in floors])
    tested = rms(np.concatenate(list(sound.values())))
    parts = {
        harmonic: HeldOutError(*(rms(column[harmonic]) for column in (*errors, floors)), count=len(floors[harmonic]))
        for harmonic in floors
    }
    return Gain(
        *map(rms, whole),
        by_harmonic=parts,
        expected=rms(np.concatenate(list(right.values()))),
        in_deviations=(rms(whole[0] * known) / tested, rms(whole[1] * known) / tested),
        runs=tuple(Path(run).name for run in runs),
        sweeps=sweeps or tuple(dict.fromkeys(state.sweep for state in unseen.steps.states)),
    )


def elsewhere(model: FittedModel) -> FittedModel:
    """The model as it predicts other recordings, whose shifts nobody knows."""
    baseline = model.baseline
    return replace(model, baseline=replace(baseline, shifts=np.zeros_like(baseline.shifts)))


def _wander(shifts: NDArray[np.float64], evidence: MeasuredData) -> float:
    """Standard deviation of one more sweep's shift from the mean of those about its mode that were learnt from."""
    about = swept_modes(evidence, len(shifts))
    sweeps = about >= 0
    count, modes = int(np.count_nonzero(sweeps)), len(np.unique(about[sweeps]))
    return float(np.sqrt(np.sum(shifts[sweeps] ** 2) / max(count - modes, 1) * (1 + modes / max(count, 1))))


def _of_a_right_model(
    learnt: LearntFrom, unseen: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals
) -> tuple[Array, dict[int, Array]]:
    """Relative errors (s o,) of a sound rig's fundamentals, and as :func:`relative_errors` those that data leave open.

    The first are of noise, the model error that such rigs have and a sweep's shift, the others of the parameters.
    """
    sizes = sound_errors(learnt[0]).log_sizes.copy()
    sizes[OF_SOFTENING:] = model.errors.log_sizes[OF_SOFTENING:]  # how rough the laws are is the joints' own
    errors = model.errors.with_log_sizes(sizes)
    problem = FitProblem(*learnt, model.baseline, model.hypotheses, errors=errors)
    J = problem.weighed().here.jacobian
    there = FitProblem(unseen, harmonics, elsewhere(model).baseline, model.hypotheses, errors=errors).weighed()
    changes = ResidualColumns.of(there.here.jacobian, there.here.blocks, there.held)
    information = Cholesky.of(J.T @ J + problem.precision)

    def of_parameters(change: Array) -> Array:
        return np.sum(change * information.solve(change.T).T, axis=1)

    rows = changes.steps.reshape(-1, changes.count)
    left_open = {1: _of_complex(of_parameters(rows).reshape(len(unseen.steps), -1))}
    measured, _, out = measured_second(unseen, harmonics)
    if out.any():
        second = second_harmonic(harmonics, changes.harmonics)[out]
        left_open[2] = np.sqrt(of_parameters(second.real) + of_parameters(second.imag)) / np.abs(measured[out])
    made_of = there.held.made_of
    assert made_of is not None
    by_shift = _wander(model.baseline.shifts, learnt[0]) * made_of.shifts[1]
    sound = np.sum(made_of.of_steps(SOUND.steps).factor ** 2, axis=2) + np.sum(by_shift**2, axis=2)
    return _of_complex(sound), left_open


def _of_complex(variance: Array) -> Array:
    """Sizes (s o,) of complex errors, from the variances (s, 2 o) of their real and of their imaginary parts."""
    return np.asarray(np.sqrt(variance.reshape(len(variance), 2, -1).sum(axis=1))).ravel()
