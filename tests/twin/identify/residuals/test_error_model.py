"""Covariances of residuals against draws of every error put through dense matrices; how fits come down to them."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from circular_noise import circular
from scipy.stats import chi2, halfcauchy, norm

from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward import forward_model
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.error_model import (
    SOUND,
    SPREAD,
    Discrepancy,
    continuation,
    log_prior,
    log_prior_slopes,
)
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
ABOUT_MODE_1 = 2 * np.pi * np.array([25.9, 26.3, 26.5, 26.9])
BAND = 2 * np.pi * np.array([20.0, 26.4, 60.0, 110.0, 156.0, 300.0, 470.0])
DRAWS = 200
FINE = 1e-5
"""Relative noise where another error is looked at: still many times what the model leaves out."""


def with_value(errors, kind, name, value):
    """The same but for one number."""
    return replace(errors, **{kind: replace(getattr(errors, kind), **{name: value})})


@pytest.fixture(autouse=True)
def fundamentals_alone(monkeypatch):
    """The layer has no harmonics of its own, in the dense structure as in the model."""
    monkeypatch.setattr(forward_model, "HARMONIC_TURNS", 0)


@pytest.fixture(scope="module")
def baseline():
    """A softening, losing joint, which follows the amplitude of the tip."""
    base = nominal_parameters(STEEL)
    opening, slip = np.geomspace(5e-8, 8e-6, 6), np.geomspace(2e-8, 2e-6, 7)
    law = LayerLaw(opening, slip, base.E * np.linspace(0.02, 0.5, 6), base.G * np.linspace(0.1, 6.0, 7) ** 1.2)
    return BaselineParameters(base, (law,))


def assert_white(draws):
    """Draws (d, n) are uncorrelated and of unit size: no variance or correlation is five deviations off."""
    count, n = draws.shape
    # Covariances have deviations of 1 / sqrt(d), variances of sqrt(2 / d).
    deviation = np.sqrt((1 + np.eye(n)) / count)
    assert np.max(np.abs(draws.T @ draws / count - np.eye(n)) / deviation) < 5
    assert chi2.ppf(1e-6, draws.size) < np.sum(draws**2) < chi2.isf(1e-6, draws.size)


@pytest.mark.parametrize("large", [
    {"reading": (FINE, 1e-3)}, {"reading": (1e-3, FINE)}, {"force": 1e-3}, {"growth": 2e-3}, {"stiffness": 1e-5},
    {"ratio": 1e-3},
    {"reading": (1e-3, 2e-3), "force": 1e-3, "growth": 2e-3, "stiffness": 1e-5, "ratio": 1e-3},
], ids=["noise of the reference", "noise of another channel", "noise of the force", "noise of the growth", "stiffness",
        "ratio", "all together"])  # fmt: skip
def test_whitened_steps_are_independent_and_of_unit_size(build, steel_model, steel_dense, baseline, large):
    """The law follows the amplitude that was read, so that its noise is in every prediction; growth is told in parts.

    Errors of stiffness are put into the matrices, one for each mode at each step.
    """
    size = {"reading": (FINE, FINE), "force": FINE, "growth": 0.0, "stiffness": 0.0, "ratio": FINE} | large
    rng, omega, tip = np.random.default_rng(1), np.repeat(ABOUT_MODE_1, DRAWS), 1.5e-3
    count = len(omega)
    held = steel_dense.modal_stiffness(circular(rng, size["stiffness"], (count, LIMITS.damped_modes)))
    H, _ = steel_dense.with_law(omega, np.full(count, tip), baseline.base, baseline.laws[0], held=held)
    ratio = circular(rng, size["ratio"], H.shape)
    # The tip moves as it is said to, so that its error is one of the force.
    force = tip * omega[:, None] ** 2 / (H[:, 1:] * (1 + ratio[:, 1:]))
    exact = build.steps(omega, force, (H * (1 + ratio) * force)[:, :, None], growth_std=size["growth"])
    response, reading = exact.response.copy(), np.array(size["reading"])
    response[:, :, 0] *= 1 + circular(rng, reading, H.shape)
    force = exact.force * (1 + circular(rng, size["force"], (count, 1)))
    steps = replace(
        exact,
        force=force,
        force_variance=(size["force"] * np.abs(force)) ** 2,
        response=response,
        response_variance=(reading[:, None] * np.abs(response)) ** 2,
        growth=size["growth"] * (rng.standard_normal(count) + 1j * rng.standard_normal(count)),
    )
    errors = replace(SOUND, steps=Discrepancy(size["stiffness"], size["ratio"]))
    model = ResidualModel(build.evidence(steel_model, steps), errors=errors)
    residual = model.evaluate(baseline, sensitivities=False).residual
    for draws in residual.reshape(len(ABOUT_MODE_1), DRAWS, -1):
        assert_white(draws)


@pytest.mark.parametrize(
    "large", [{"noise": 1e-3}, {"stiffness": 1e-5}, {"ratio": 1e-4}], ids=lambda large: next(iter(large))
)
def test_whitened_broadband_bins_are_independent_and_of_unit_size(build, steel_model, steel_dense, baseline, large):
    """Channels err against each other by as much more as a response lies below its surroundings."""
    size = {"noise": FINE, "stiffness": 0.0, "ratio": FINE} | large
    rng, covariance = np.random.default_rng(2), np.tile(size["noise"] ** 2 * np.eye(2) + 0j, (len(BAND), 1, 1))
    depth = build.bins(BAND / (2 * np.pi), steel_dense.accelerance(BAND, baseline.base), covariance).depth
    runs = []
    for _ in range(DRAWS):
        held = steel_dense.modal_stiffness(circular(rng, size["stiffness"], (len(BAND), LIMITS.damped_modes)))
        H = steel_dense.accelerance(BAND, baseline.base, held=held)
        error = circular(rng, size["noise"], H.shape) + circular(rng, size["ratio"] * depth, H.shape)
        runs.append(build.bins(BAND / (2 * np.pi), H * np.exp(error), covariance))
    errors = replace(SOUND, broadband=Discrepancy(size["stiffness"], size["ratio"]))
    evidence = build.evidence(steel_model, build.steps(np.zeros(0), np.zeros((0, 1)), np.zeros((0, 2, 1))), runs)
    residual = ResidualModel(evidence, errors=errors).evaluate(baseline, sensitivities=False).residual
    assert_white(residual.reshape(DRAWS, -1))


def test_fits_come_to_their_errors_through_ever_smaller_ones():
    levels = continuation(SOUND)
    assert levels[-1] is SOUND
    for wider, narrower in pairwise(levels):
        for kind in ("steps", "broadband"):
            for name in ("stiffness", "ratio"):
                assert getattr(getattr(wider, kind), name) >= getattr(getattr(narrower, kind), name)
        assert wider.steps.stiffness > narrower.steps.stiffness
        assert wider.frequency > narrower.frequency
        assert wider.moduli <= narrower.moduli


def test_a_model_that_errs_by_much_is_not_fitted_with_less_on_the_way():
    wrong = replace(SOUND, steps=replace(SOUND.steps, stiffness=2e-3))
    assert [level.steps.stiffness for level in continuation(wrong)] == [1e-2, 3e-3, 2e-3]
    far = replace(SOUND, steps=replace(SOUND.steps, stiffness=1.0))
    assert continuation(far) == (far,)


@pytest.mark.parametrize("kind", ["steps", "broadband"])
@pytest.mark.parametrize("name", ["stiffness", "ratio"])
def test_a_model_is_sound_while_it_errs_no_more_in_any_data_than_sound_rigs_do(kind, name):
    usual = getattr(getattr(SOUND, kind), name)
    assert SOUND.as_small_as(SOUND)
    assert with_value(SOUND, kind, name, 2.9 * usual).as_small_as(SOUND)
    assert not with_value(SOUND, kind, name, 3.1 * usual).as_small_as(SOUND)


def test_the_prior_of_errors_is_log_normal_about_those_of_sound_rigs_and_of_roughness_half_cauchy():
    """The Cauchy's density is of the roughness, ours of its logarithm."""
    errors = with_value(SOUND, "steps", "ratio", 5 * SOUND.steps.ratio)
    errors = with_value(errors, "broadband", "stiffness", SOUND.broadband.stiffness / 2)
    errors = replace(errors, roughness=(SOUND.roughness[0], 3 * SOUND.roughness[1]), harmonics=4.0, shifts=0.2)
    expected = norm.logpdf(np.log([1.0, 5.0, 0.5, 1.0, 4.0, 0.2]), scale=SPREAD).sum()
    expected += sum(halfcauchy.logpdf(size) + np.log(size) for size in (1.0, 3.0))
    assert log_prior(errors) == pytest.approx(expected)


@pytest.mark.parametrize("free", [True, False])
def test_the_slopes_of_the_prior_are_those_of_its_density(free):
    away = np.array([0.4, -1.0, 2.0, 0.3, -0.7, 1.1, -6.0, 1.5])
    slopes = log_prior_slopes(SOUND.with_log_sizes(SOUND.log_sizes + away), free=free)
    for which, slope in enumerate(slopes):
        step = 1e-5 * (np.arange(len(away)) == which)
        above, below = (log_prior(SOUND.with_log_sizes(SOUND.log_sizes + away + by), free=free) for by in (step, -step))
        assert slope == pytest.approx((above - below) / 2e-5, rel=1e-6, abs=1e-8)


def test_a_lacking_model_may_have_errors_of_stiffness_of_any_size_but_ratios_as_ever():
    """A density of the logarithm that is even up to the largest, and integrates to one."""
    sizes = np.geomspace(1.0, LIMITS.error_model_any, 1001)
    priors = [
        log_prior(with_value(SOUND, "steps", "stiffness", size * SOUND.steps.stiffness), free=True) for size in sizes
    ]
    rest = norm.logpdf(0.0, scale=SPREAD) * 4 + 2 * halfcauchy.logpdf(1.0) - np.log(np.log(LIMITS.error_model_any))
    assert np.trapezoid(np.exp(np.array(priors) - rest), np.log(sizes)) == pytest.approx(1.0)
    ratio = with_value(SOUND, "steps", "ratio", 3 * SOUND.steps.ratio)
    assert log_prior(ratio, free=True) == pytest.approx(log_prior(SOUND, free=True) - 0.5)
