"""Fits of causes and their evidence, where both are known in closed form."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from recordings import read_run
from twin.diagnose.cause import Parameter
from twin.diagnose.fitted_model import CauseHypothesis, FitProblem, FittedModel, log_evidence, modification_of
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import fit_base
from twin.identify.gauss_newton import minimise
from twin.identify.harmonics import harmonic_residuals
from twin.identify.measured_data import gather_data
from twin.identify.residual_model import ResidualModel
from twin.rigs import load_rig


@pytest.fixture
def problem():
    """A linear model of three unknowns, with a prior that is not diagonal, and the columns of two causes."""
    rng = np.random.default_rng(17)
    J = rng.standard_normal((30, 3)) * np.array([3.0, 1.0, 0.2])
    root = rng.standard_normal((3, 3))
    precision = root @ root.T + 0.5 * np.eye(3)
    columns = {"one": rng.standard_normal(30), "two": rng.standard_normal(30)}
    data = J @ np.array([0.5, -1.0, 2.0]) + 2.0 * columns["one"] + rng.standard_normal(30)
    return J, precision, columns, data


PARAMETERS = {
    "one": Parameter(name="one", scale=0.02, lower=-1.0, upper=1.0, null=0.0, starts=(0.001,)),
    "two": Parameter(name="two", scale=3e5, lower=0.0, upper=1e8, null=1e5, starts=(2e5,)),
}
"""Causes' columns are per unit of their parameters' scale, as a fit has them."""


def fitted(problem, names):
    """The fit's solution and its evidence."""
    J, precision, columns, data = problem
    parameters = [PARAMETERS[name] for name in names]
    A = np.column_stack([J, *(columns[name] for name in names)])
    null = np.array([p.null / p.scale for p in parameters])
    mean = np.concatenate([np.zeros(3), null])
    whole = np.eye(len(mean))
    whole[:3, :3] = precision
    shifted = np.concatenate([np.zeros(3), null])

    def evaluate(x):
        return data - A @ (x - shifted), A

    solution = minimise(evaluate, mean, mean=mean, precision=whole, tolerance=1e-9)
    return log_evidence(solution, precision, parameters)


def marginal(problem, names):
    """Log density of the data with all unknowns integrated out."""
    J, precision, columns, data = problem
    covariance = np.eye(len(data)) + J @ np.linalg.inv(precision) @ J.T
    for name in names:
        covariance += np.outer(columns[name], columns[name])
    return multivariate_normal(np.zeros(len(data)), covariance).logpdf(data)


@pytest.mark.parametrize("names", [("one",), ("two",), ("one", "two")])
def test_log_evidence_is_the_marginal_likelihood_but_for_what_all_models_share(problem, names):
    found = fitted(problem, names) - fitted(problem, ())
    assert found == pytest.approx(marginal(problem, names) - marginal(problem, ()), abs=1e-6)


def test_what_all_models_share_is_the_noises_own_constant(problem):
    data = problem[-1]
    constant = -0.5 * len(data) * np.log(2 * np.pi)
    assert fitted(problem, ()) + constant == pytest.approx(marginal(problem, ()), abs=1e-6)


def test_evidence_is_for_the_cause_that_is_there_and_against_the_one_that_is_not(problem):
    assert fitted(problem, ("one",)) > fitted(problem, ())
    assert fitted(problem, ("one", "two")) < fitted(problem, ("one",))


def test_a_place_costs_what_an_even_spread_of_places_has_as_its_variance(problem):
    """A uniform prior of the same width, by its mean and variance: what it cannot tell is paid for by its width."""
    J, precision, columns, data = problem
    place = Parameter(name="place", scale=0.4, lower=0.0, upper=0.8)
    A = np.column_stack([J, columns["one"]])
    width = 0.8 / 0.4
    mean = np.array([0.0, 0.0, 0.0, width / 2])
    whole = np.eye(4)
    whole[:3, :3] = precision
    whole[3, 3] = 12 / width**2
    solution = minimise(lambda x: (data - A @ x, A), mean, mean=mean, precision=whole, tolerance=1e-9)
    found = log_evidence(solution, precision, [place])
    covariance = np.eye(len(data)) + A @ np.linalg.inv(whole) @ A.T
    expected = multivariate_normal(A @ mean, covariance).logpdf(data)
    assert found - 0.5 * len(data) * np.log(2 * np.pi) == pytest.approx(expected, abs=1e-6)


def test_weight_forgives_the_variance_by_which_the_best_model_misses(problem):
    """Tempered by t, chi2 counts a t-th; below one nothing is forgiven."""
    J, precision, _, data = problem
    solution = minimise(lambda x: (data - J @ x, J), np.zeros(3), mean=np.zeros(3), precision=precision)
    evidence = log_evidence(solution, precision, [])
    fitted_model = FittedModel((), None, solution, evidence, 27)
    tempered = log_evidence(replace(solution, chi2=solution.chi2 / 4), precision, [])
    assert fitted_model.weight(4.0) == pytest.approx(tempered)
    assert fitted_model.weight(0.5) == fitted_model.weight(1.0) == pytest.approx(evidence)
    assert fitted_model.chi2_per_dof == pytest.approx(solution.chi2 / 27)


def test_blames_add_up_to_one_extension():
    """Factors multiply, whatever their order; a key names the cause and the channel at fault."""
    gain = CauseHypothesis(CAUSES["channel-gain"], {"channel": "acc1"}, {"factor": 1.1}, {})
    delay = CauseHypothesis(CAUSES["channel-delay"], {"channel": "acc1"}, {"delay_s": 1e-4}, {})
    clock = CauseHypothesis(CAUSES["sample-clock"], {}, {"error_ppm": 200.0}, {})
    omega = np.array([10.0, 1000.0])
    for hypotheses in ((gain, delay, clock), (clock, delay, gain)):
        whole = modification_of(None, hypotheses)
        assert whole.channel_factor["acc1"](omega) == pytest.approx(1.1 * np.exp(-1e-4j * omega))
        assert whole.frequency_factor == pytest.approx(1.0002)
    assert gain.key == "channel-gain acc1"
    assert clock.key == "sample-clock"


@pytest.fixture(scope="module")
def fitted_recordings(campaign):
    evidence = gather_data(
        [read_run(campaign / name) for name in ("sweeps.mcap", "random.mcap")], load_rig("steel-lap-joint")
    )
    baseline = fit_base(evidence)[0]
    return evidence, harmonic_residuals(ResidualModel(evidence), baseline), baseline


@pytest.mark.parametrize("name", [name for name in CAUSES if name != "channel-polarity"])
def test_sensitivities_to_a_cause_are_those_of_central_differences(fitted_recordings, name):
    """Rounding must not drown them, nor sharp resonances bend away from them."""
    evidence, harmonics, baseline = fitted_recordings
    cause, label = CAUSES[name], next(iter(CAUSES[name].labels(evidence)))
    values = {
        p.name: p.starts[len(p.starts) // 2] if p.is_location else p.null + 0.1 * (p.starts[0] - p.null)
        for p in cause.parameters(evidence, label)
    }
    trial = FitProblem(evidence, harmonics, baseline, (CauseHypothesis(cause, label, values, {}),))
    trial.weigh(trial.x0)
    columns = trial.evaluate(trial.x0)[1][:, trial.count :]
    for k, (_, parameter) in enumerate(trial.slots):
        step = np.zeros(len(trial.x0))
        step[trial.count + k] = 3e-4
        there, back = (trial.predict(trial.x0 + side * step).residual for side in (1, -1))
        expected = (back - there) / (2 * 3e-4)
        assert np.linalg.norm(columns[:, k] - expected) <= 0.05 * np.linalg.norm(expected), parameter.name
