"""A place that data hardly tell: its spread against the posterior over a grid of places, each held."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, modification_of
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.marginal_likelihood import MarginalLikelihood
from twin.diagnose.marginal_posterior import marginal_over_places
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import temperature
from twin.identify.base_fit import starting_baseline
from twin.identify.forward.broadband_response import broadband_response
from twin.identify.measured_data import gather_data
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

PLACE_m = 0.30


def mass(mass_kg, position_m=PLACE_m):
    return CauseHypothesis(CAUSES["added-mass"], {}, {"mass_kg": mass_kg, "position_m": position_m}, {})


@pytest.fixture(scope="module")
def evidence_of(campaign):
    """Builds broadband evidence of a rig with so large a mass, with the noise of a real recording drawn anew."""
    noise = gather_data([read_run(campaign / "random.mcap")], load_rig("steel-lap-joint"))
    (data,) = noise.broadband
    baseline = fit_model(noise, None, starting_baseline(noise), ()).baseline

    def evidence_of(mass_kg):
        model = ResidualModel(noise, modification_of(noise, (mass(mass_kg),)))
        z = np.random.default_rng(5).standard_normal((*data.H.shape, 2)) @ np.array([1, 1j]) / np.sqrt(2)
        off = (np.linalg.cholesky(data.relative_covariance) @ z[:, :, None])[:, :, 0]
        return replace(noise, broadband=(replace(data, H=broadband_response(model, data, baseline) * np.exp(off)),))

    return evidence_of


def found_in(evidence, mass_kg, position_m=PLACE_m, held=None):
    """The problem at its fit, with one place held or with all free."""
    fit = fit_model(
        evidence, None, starting_baseline(evidence), (mass(mass_kg, position_m),), options=FitOptions(held=held)
    )
    return FitProblem(evidence, None, fit.baseline, fit.hypotheses, held=held)


def told(problem, spread):
    (hypothesis,) = problem.hypotheses(problem.x0, spread)
    return hypothesis.values["position_m"], hypothesis.std["position_m"]


def test_a_place_hardly_told_is_as_uncertain_as_all_places_together_leave_it(evidence_of):
    evidence = evidence_of(5e-5)
    place, std = told(*marginal_over_places(found_in(evidence, 5e-5), None))
    grid = np.linspace(0.225, 0.36, 10)  # about the mode that was fitted
    log_density = []
    for position_m in grid:
        problem = found_in(evidence, 5e-5, position_m, held=(0, "position_m"))
        log_density.append(MarginalLikelihood(problem.weighed(), None).at(problem.errors).log_likelihood)
    weights = np.exp((np.array(log_density) - max(log_density)) / temperature(evidence))
    expected = np.sqrt(weights @ (grid - place) ** 2 / weights.sum())
    assert expected > 0.02
    assert std == pytest.approx(expected, rel=0.25)
    assert abs(place - PLACE_m) < 2 * std


def test_a_place_told_well_is_as_uncertain_as_its_own_neighbourhood_leaves_it(evidence_of):
    evidence = evidence_of(0.02)
    problem = found_in(evidence, 0.02)
    place, std = told(*marginal_over_places(problem, None))
    step = MarginalLikelihood(problem.weighed(), None).at(problem.errors)
    number = [p.name for _, p in problem.slots].index("position_m")
    x = problem.count + number
    data = (step.information - step.precision) / temperature(evidence)
    variance = np.linalg.inv(data + step.precision)[x, x]
    local = np.sqrt(variance + step.step[x] ** 2) * problem.slots[number][1].scale
    assert std == pytest.approx(local, rel=0.05)
    assert place == pytest.approx(PLACE_m, abs=4 * std)
    assert std < 2e-3
