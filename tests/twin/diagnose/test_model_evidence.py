"""Log evidence against a dense oracle, and model errors found again that data were drawn with."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem
from twin.diagnose.fitted_model import fitted
from twin.diagnose.marginal_likelihood import MarginalLikelihood
from twin.diagnose.model_evidence import infer_errors, unexplained, with_spread
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import temperature
from twin.diagnose.residual_columns import tolerances_of
from twin.identify import frequency_shifts
from twin.identify.base_fit import starting_baseline
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.gauss_newton import minimise
from twin.identify.measured_data import gather_data
from twin.identify.model_modification import ModelModification
from twin.identify.residuals import error_model, residual_model
from twin.identify.residuals.error_model import SOUND, Discrepancy, ErrorModel, log_prior
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.spectra.sweeps import rows_by_sweep
from twin.rigs import load_rig

LABEL = {"channel": "acc1"}


@pytest.fixture(scope="module")
def measured(campaign):
    """Frequencies, forces and noise of real recordings."""
    runs = [read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")]
    return gather_data(runs, load_rig("steel-lap-joint"))


@pytest.fixture(scope="module")
def baseline(measured):
    """No unknown at a limit, which no Gaussian has."""
    found = starting_baseline(measured)
    base = replace(found.base, loss_E=np.array([0.02]), loss_G=np.array([0.05]))
    return replace(found, base=base, laws=tuple(replace(law, loss=np.full(len(law.loss), 5e6)) for law in found.laws))


@pytest.fixture(scope="module")
def drawn(measured, baseline):
    """Builds evidence from the model at the unknowns, with noise and model errors drawn."""

    at, (data,), steps = measured.reference, measured.broadband, measured.steps
    residual_model = ResidualModel(measured)
    R, omega, _ = residual_model.step_receptance(baseline)
    of_steps, of_bins = residual_model.responses(R, omega), broadband_response(residual_model, data, baseline)

    def having(bins, steps_off):
        """Responses off by these factors; the reference channel moves as measured, for the law goes by that."""
        response, force = steps.response.copy(), steps.force.copy()
        force[:, 0] = response[:, at, 0] / (of_steps * steps_off)[:, at]
        response[:, :, 0] = of_steps * steps_off * force[:, :1]
        binned = replace(data, H=of_bins * bins)
        return replace(measured, broadband=(binned,), steps=replace(steps, response=response, force=force))

    exact = having(np.ones_like(of_bins), np.ones_like(of_steps))

    def drawn(errors, seed):
        rng = np.random.default_rng(seed)
        made_of = ResidualModel(exact).linearisation(baseline, sensitivities=False).made_of
        (white,) = made_of.of_broadband(errors.broadband)
        z = rng.standard_normal((*of_bins.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
        bins = np.exp(white.factor @ z[:, :, None])[:, :, 0]
        z = rng.standard_normal((len(steps), 2 * of_steps.shape[1], 1))
        real, imaginary = np.split((made_of.of_steps(errors.steps).factor @ z)[:, :, 0], 2, axis=1)
        return having(bins, 1 + real + 1j * imaginary)

    return drawn


def errors_of(size):
    """Every model error, over a sound rig's."""
    pairs = (Discrepancy(size * e.stiffness, size * e.ratio) for e in (SOUND.steps, SOUND.broadband))
    steps, broadband = pairs
    return ErrorModel(steps=steps, broadband=broadband)


def with_gain(baseline, evidence, harmonics=None):
    """The base family with a gain at fault that is none."""
    hypothesis = CauseHypothesis(CAUSES["channel-gain"], LABEL, {"factor": 1.0}, {})
    return lambda errors: FitProblem(evidence, harmonics, baseline, (hypothesis,), errors=errors)


def solved_at_the_start(weighed):
    """A search that goes nowhere."""

    def evaluate(x):
        found = weighed.evaluate(x)
        return found.residual, found.jacobian

    problem = weighed.problem
    return minimise(evaluate, problem.x0, mean=problem.mean, precision=problem.precision, iterations=0)


def oracle(problem):
    """Log density of all data, every parameter and shift integrated out, but for the constant of so many numbers."""
    weighed = problem.weighed()
    r, J = weighed.here.residual, weighed.here.jacobian
    data = r + J @ (problem.x0 - problem.mean)
    model = problem.residual_model(problem.x0, weighed.held)
    made_of = model.linearisation(problem.baseline(problem.x0), sensitivities=False).made_of
    shifts = tolerances_of(np.zeros((len(r), 0)), weighed.here.blocks, weighed.held)
    shifts = shifts.whitened(weighed.held)
    covariance = np.eye(len(r)) + J @ np.linalg.solve(problem.precision, J.T) + shifts @ shifts.T
    # A complex number of a broadband run is two real ones.
    noise = 2 * sum(white.log_determinant() for white in made_of.of_broadband(problem.errors.broadband))
    noise += made_of.of_steps(problem.errors.steps).log_determinant()
    return -0.5 * (data @ np.linalg.solve(covariance, data) + np.linalg.slogdet(covariance)[1] + noise)


@pytest.mark.parametrize("size", [1.0, 10.0])
def test_log_evidence_is_the_marginal_likelihood_with_the_inferred_errors(drawn, baseline, size):
    """That of all data, the volume of their covariance included: else larger errors would cost nothing."""
    problem = with_gain(baseline, drawn(errors_of(size), seed=1))
    inferred, log_evidence = infer_errors(problem(SOUND), None)
    assert log_evidence == pytest.approx(oracle(problem(inferred)) + log_prior(inferred), abs=0.05)


def test_what_sound_rigs_have_of_a_cause_is_integrated_over_as_a_cause_is(drawn, baseline):
    evidence = drawn(errors_of(1.0), seed=2)
    with_it = with_gain(baseline, evidence)(SOUND).weighed()
    column = with_it.here.jacobian[:, with_it.problem.count :]
    tolerances = tolerances_of(column, with_it.here.blocks, with_it.held)
    without = FitProblem(evidence, None, baseline, ()).weighed()
    named, tolerated = MarginalLikelihood(with_it, None), MarginalLikelihood(without, tolerances)
    for errors in (SOUND, errors_of(3.0)):
        alike = named.at(errors).log_likelihood
        assert tolerated.at(errors).log_likelihood == pytest.approx(alike, abs=1e-3)


@pytest.mark.parametrize("size", [0.3, 5.0])
def test_slopes_of_the_evidence_are_its_differences(drawn, baseline, size):
    """By the logarithm of each error: fourth-order differences of the likelihood itself, with all kinds of data."""
    evidence = drawn(errors_of(2.0), seed=6)
    harmonics = harmonic_residuals(ResidualModel(evidence), baseline)
    marginal = MarginalLikelihood(with_gain(baseline, evidence, harmonics)(SOUND).weighed(), None)
    errors = SOUND.with_log_sizes(SOUND.log_sizes + np.log(size))
    sizes, step = errors.log_sizes, 1e-2

    def at(away):
        return marginal.at(errors.with_log_sizes(sizes + away)).log_likelihood

    found, slopes = marginal.with_slopes(errors)
    assert found == at(np.zeros(len(sizes)))
    for which, slope in enumerate(slopes):
        away = step * (np.arange(len(sizes)) == which)
        difference = (8 * (at(away) - at(-away)) - at(2 * away) + at(-2 * away)) / (12 * step)
        assert slope == pytest.approx(difference, rel=1e-4, abs=1e-3)
        assert slope != 0


def test_noise_alone_leaves_what_its_unknowns_do_not_explain(measured, baseline):
    """One run has no shift among the unknowns: it is a tolerance, of data that are there and of those that are not."""
    noise = measured.without_steps()
    problem = FitProblem(noise, None, starting_baseline(noise), ())
    weighed = problem.weighed()
    r = weighed.here.residual
    tolerances = tolerances_of(np.zeros((len(r), 0)), weighed.here.blocks, weighed.held)
    assert tolerances.whitened(weighed.held).shape == (len(r), 1)
    solution = solved_at_the_start(weighed)
    _, left = unexplained(noise, None, fitted(problem, solution), tolerances)
    assert left.shape == r.shape
    assert np.sum(left**2) < np.sum(r**2)


def test_a_cause_is_as_uncertain_as_all_that_a_sound_rig_may_have_leaves_it(drawn, baseline):
    """Conditioned on the data's joint density with the tolerances, for a gain whose fit never saw them."""
    problem = with_gain(baseline, drawn(errors_of(1.0), seed=3))(SOUND)
    weighed = problem.weighed()
    r, J = weighed.here.residual, weighed.here.jacobian
    rng = np.random.default_rng(4)
    directions = 30.0 * J[:, problem.count :] + rng.standard_normal((len(r), 3))
    tolerances = tolerances_of(directions, weighed.here.blocks, weighed.held)
    solution = solved_at_the_start(weighed)
    found = with_spread(problem.evidence, None, fitted(problem, solution), tolerances)

    white = tolerances.whitened(weighed.held)
    prior = np.linalg.inv(problem.precision)
    of_data = J @ prior @ J.T + white @ white.T

    def gain_with(noise):
        return np.linalg.solve(noise * np.eye(len(r)) + of_data, J @ prior).T

    gain, counted = gain_with(1.0), gain_with(temperature(problem.evidence))
    mean = problem.mean + gain @ (r + J @ (problem.x0 - problem.mean))
    variance = (prior - counted @ J @ prior)[-1, -1]
    (_, parameter), (hypothesis,) = problem.slots[0], found.hypotheses
    away = np.sqrt(variance + (mean - problem.x0)[-1] ** 2) * parameter.scale
    assert hypothesis.std["factor"] == pytest.approx(away, rel=1e-3)
    assert hypothesis.values["factor"] == 1.0


def test_a_sweep_that_is_shifted_as_a_whole_is_no_model_error(measured, baseline):
    """By 4e-5 of its frequencies, a hundredth of a resonance's width: a laboratory's temperature does that."""
    steps, at = measured.steps, measured.reference
    plain, shifted = (
        ResidualModel(measured, ModelModification(frequency_factor=factor)) for factor in (1.0, 1.0 + 4e-5)
    )
    response, force = steps.response.copy(), steps.force.copy()
    first = next(iter(rows_by_sweep(steps.states).values()))
    for model, rows in ((plain, slice(None)), (shifted, first)):
        R, omega, _ = model.step_receptance(baseline)
        ratio = model.responses(R, omega)
        force[rows, 0] = (response[:, at, 0] / ratio[:, at])[rows]
        response[rows, :, 0] = (ratio * force[:, :1])[rows]
    (data,) = measured.broadband
    binned = replace(data, H=broadband_response(plain, data, baseline))
    evidence = replace(measured, broadband=(binned,), steps=replace(steps, response=response, force=force))
    problem = FitProblem(evidence, None, baseline, ())
    inferred, with_shifts = infer_errors(problem, None)
    assert inferred.steps.stiffness < SOUND.steps.stiffness
    with pytest.MonkeyPatch.context() as patch:
        for module in (error_model, frequency_shifts, residual_model):
            patch.setattr(module, "SHIFT", 1e-12)
        inferred, without = infer_errors(problem, None)
    assert inferred.steps.stiffness > 3 * SOUND.steps.stiffness
    assert with_shifts > without + 100


@pytest.mark.parametrize("size", [1.0, 30.0])
def test_the_error_that_data_were_drawn_with_is_found(drawn, baseline, size):
    """Of stiffness, which may be of any size where a model lacks something; ratios stay what sound rigs' are.

    In the median of five draws: one alone scatters by a third.
    """
    true = replace(
        SOUND,
        steps=replace(SOUND.steps, stiffness=size * SOUND.steps.stiffness),
        broadband=replace(SOUND.broadband, stiffness=size * SOUND.broadband.stiffness),
    )
    found = [infer_errors(FitProblem(drawn(true, seed=s), None, baseline, ()), None, free=True)[0] for s in range(1, 6)]
    for kind in ("steps", "broadband"):
        middle = np.median([getattr(one, kind).stiffness for one in found])
        assert middle == pytest.approx(getattr(true, kind).stiffness, rel=0.25), kind
