"""The score test's first order against refits, a dense oracle, and what the unknowns can explain by themselves."""

from __future__ import annotations

from dataclasses import dataclass, replace
from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
from numpy.linalg import norm

from recordings import read_run
from twin.causes.joint_stiffness.model import SCALE
from twin.diagnose.cause import Cause, strengths_of
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, modification_of
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.models import CAUSES
from twin.diagnose.selection import score_test
from twin.diagnose.selection.score_test import score_causes
from twin.identify import frequency_shifts
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.linear.blocks import Blocks
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import gather_data
from twin.identify.model_modification import ModelModification
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots
from twin.identify.residuals import error_model
from twin.identify.residuals import residual_model as residual_models
from twin.identify.residuals.error_model import SOUND, log_prior
from twin.identify.residuals.likelihood import residual_model
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import Saturating
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


@pytest.fixture(scope="module")
def measured(campaign):
    """Frequencies, forces and noise of real recordings."""
    return gather_data([read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], RIG)


@pytest.fixture(scope="module")
def baseline(measured):
    """What is assumed, some loss in the joint so that its limit at zero is far, and no nonlinear law."""
    base = replace(nominal_parameters(RIG), loss_E=0.02, loss_G=0.05)
    knots = choose_knots(np.array([1e-5]), 4)
    return BaselineParameters(base, (LayerLaw.zero(knots, knots),))


@pytest.fixture(scope="module")
def having(measured, baseline):
    """Builds evidence in which all responses are those of the model with a cause, with noise or without."""

    def having(name="", label=None, values=None, *, at=None, noise=0.0):
        at = at or baseline
        hypotheses = (CauseHypothesis(CAUSES[name], label or {}, values, {}),) if name else ()
        residual_model = ResidualModel(measured, modification_of(measured, hypotheses))
        rng = np.random.default_rng(12)

        def noisy(H):
            return H * (1 + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))

        (data,) = measured.broadband
        rest = np.zeros(len(data.omega))
        R = residual_model.receptance(data.omega, at.base, rest)
        bins = replace(data, H=noisy(residual_model.responses(R, data.omega)))
        response = measured.steps.response.copy()
        response[:, :, 0] = (
            noisy(residual_model.responses(*residual_model.step_receptance(at)[:2])) * measured.steps.force[:, :1]
        )
        return replace(measured, broadband=(bins,), steps=replace(measured.steps, response=response))

    return having


LAW_TOLERANCES = score_test.law_tolerances


@pytest.fixture(autouse=True)
def nothing_tolerated(monkeypatch):
    """Refits have no shifts of runs and sweeps and one mean of openings, and so have the scores beside them."""
    for module in (error_model, frequency_shifts, residual_models):
        monkeypatch.setattr(module, "SHIFT", 1e-12)
    monkeypatch.setattr(score_test, "law_tolerances", lambda *given: ([], []))


@dataclass(frozen=True)
class Tolerated(Cause):
    """A cause of which sound rigs have as much as is given, in shares of its scale."""

    cause: Cause
    tolerance: float

    def labels(self, evidence):
        return self.cause.labels(evidence)

    def parameters(self, evidence, label):
        return tuple(replace(p, tolerance=self.tolerance) for p in self.cause.parameters(evidence, label))

    def modification(self, evidence, label, values):
        return self.cause.modification(evidence, label, values)


def model_at(baseline):
    """The base family at these unknowns."""
    return FittedModel((), baseline, SOUND, cast("Any", None), 0.0, 1)


def scored(evidence, baseline, *names, tolerance=0.0, hypotheses=()):
    """Scores of some causes beside the base family at the unknowns; sound rigs have none of them unless said."""
    causes = {name: Tolerated(CAUSES[name], tolerance) for name in names}
    return score_causes(evidence, None, replace(model_at(baseline), hypotheses=hypotheses), causes)[0]


def labelled(scores, label):
    """The one score with this label."""
    (score,) = [score for score in scores if score.hypothesis.label == label]
    return score


def fall(evidence, score):
    """Fall of the cost of a fit, to first order: of the residuals and the priors with the cause's own."""
    main = strengths_of(score.hypothesis.cause.parameters(evidence, score.hypothesis.label))[0]
    return (score.size / score.std) ** 2 / (1 + (score.std / main.scale) ** 2)


SMALL = {
    "drive-mass": ({}, {"mass_kg": -1e-3}),
    "stinger-stiffness": ({}, {"stiffness_N_per_m": 6000.0}),
    "base-motion": ({}, {"receptance_m_per_N": 2e-9}),
    "channel-gain": ({"channel": "acc1"}, {"factor": 1.001}),
    "cross-talk": ({"channel": "acc1", "source": "acc2"}, {"factor": 1e-3}),
    "joint-uneven": ({}, {"gradient": 0.15}),
}
"""Effects well above the noise, and so small that they are linear."""


def refitted(evidence, baseline, *hypotheses):
    """The base family with these causes at its minimum."""
    return fit_model(evidence, None, baseline, hypotheses, options=FitOptions(iterations=50, tolerance=1e-7))


@pytest.mark.parametrize("name", SMALL)
def test_the_first_orders_gain_is_that_of_a_refit(having, baseline, name):
    """Both with the prior's part of the cost; the data have noise beside the effect."""
    label, values = SMALL[name]
    evidence = having(name, label, values, noise=3e-4)
    base = refitted(evidence, baseline)
    score = labelled(scored(evidence, base.baseline, name), label)
    refit = refitted(evidence, base.baseline, score.hypothesis)
    fell = base.solution.cost - refit.solution.cost
    assert fell > 20
    assert fall(evidence, score) == pytest.approx(fell, rel=0.03)
    ((strength, _),) = values.items()
    null = CAUSES[name].parameters(evidence, label)[0].null
    assert score.hypothesis.values[strength] - null == pytest.approx(
        refit.hypotheses[0].values[strength] - null, rel=0.15
    )


def test_what_the_unknowns_can_explain_is_no_causes_gain(having, baseline):
    """E' off by a hundredth, nothing refitted: a factor on E' would take it all, had E' not been unknown anyway."""
    base = baseline.base
    evidence = having(at=replace(baseline, base=replace(base, E=1.01 * base.E)))
    chi2 = ResidualModel(evidence).evaluate(baseline, sensitivities=False).chi2
    (score,) = scored(evidence, baseline, "joint-stiffness")
    modification = CAUSES["joint-stiffness"].modification(
        evidence, {}, {"log_normal_factor": np.log(1.01), "log_shear_factor": 0.0}
    )
    assert ResidualModel(evidence, modification).evaluate(baseline, sensitivities=False).chi2 < 1e-3 * chi2
    assert chi2 > 100
    assert fall(evidence, score) < 1e-3 * chi2


def test_a_sound_rig_gives_no_cause_anything(having, baseline):
    """Nothing is left to explain, and what could be explained counts against a cause."""
    linear = [name for name in CAUSES if name not in ("channel-polarity", "transverse-shear")]
    assert max(score.log_bayes for score in scored(having(), baseline, *linear)) < 1e-2


@pytest.mark.parametrize("place", [0.30, 0.12])
def test_the_best_place_is_where_the_mass_sits(having, baseline, place):
    evidence = having("added-mass", {}, {"mass_kg": 2e-4, "position_m": place})
    base = refitted(evidence, baseline)
    scores = scored(evidence, base.baseline, "added-mass")
    assert [s.log_bayes for s in scores] == sorted((s.log_bayes for s in scores), reverse=True)
    starts = next(p.starts for p in CAUSES["added-mass"].parameters(evidence, {}) if p.name == "position_m")
    assert len(scores) == len(starts)
    assert scores[0].hypothesis.values["position_m"] == pytest.approx(place)


def test_a_cause_gains_nothing_beyond_its_limits(having, baseline):
    """Less damping than assumed, by a detour: no dashpot is negative."""
    evidence = having("viscous-damper", {}, {"damping_Ns_per_m": -0.02, "position_m": 0.2})
    scores = scored(evidence, baseline, "viscous-damper")
    assert all(s.hypothesis.values["damping_Ns_per_m"] >= 0 for s in scores)
    best = next(s for s in scores if s.hypothesis.values["position_m"] == pytest.approx(0.21))
    assert best.size < 0
    assert best.log_bayes <= 0.0


def test_a_cause_is_scored_beside_those_already_blamed(having, baseline):
    """Once the gain is named the delay is what is left, and is scored without the gain's part."""
    label = {"channel": "acc1"}
    evidence = having("channel-gain", label, {"factor": 1.05})
    named = CauseHypothesis(CAUSES["channel-gain"], label, {"factor": 1.05}, {})
    left = scored(evidence, baseline, "cross-talk", hypotheses=(named,))
    alone = scored(evidence, baseline, "cross-talk")
    assert max(s.log_bayes for s in alone) > 100
    assert max(s.log_bayes for s in left) < 1e-2


SHARP = {
    "clamp-compliance": ({}, {"rotational_rad_per_Nm": 3e-7}),
    "beam-modulus": ({"beam": "lower"}, {"factor": 0.999}),
}


@pytest.mark.parametrize("name", SHARP)
def test_the_first_order_holds_within_a_resonances_width(having, baseline, name):
    label, values = SHARP[name]
    evidence = having(name, label, values, noise=3e-4)
    base = refitted(evidence, baseline)
    score = labelled(scored(evidence, base.baseline, name), label)
    refit = refitted(evidence, base.baseline, score.hypothesis)
    assert fall(evidence, score) == pytest.approx(base.solution.cost - refit.solution.cost, rel=0.05)


def test_a_small_mass_at_the_tip_is_placed_at_the_tip(having, baseline):
    evidence = having("added-mass", {}, {"mass_kg": 2e-4, "position_m": 0.42})
    base = refitted(evidence, baseline)
    best = scored(evidence, base.baseline, "added-mass")[0]
    assert best.hypothesis.values["position_m"] == pytest.approx(0.42)
    assert best.hypothesis.values["mass_kg"] == pytest.approx(2e-4, rel=0.1)


def test_a_delay_that_the_losses_may_not_explain_gains_all_of_it(having, baseline):
    label, values = {"channel": "acc2"}, {"delay_s": 2e-6}
    evidence = having("channel-delay", label, values, noise=3e-4)
    base = refitted(evidence, baseline)
    assert base.baseline.base.loss_E == 0.0
    score = labelled(scored(evidence, base.baseline, "channel-delay"), label)
    refit = refitted(evidence, base.baseline, score.hypothesis)
    assert fall(evidence, score) == pytest.approx(base.solution.cost - refit.solution.cost, rel=0.05)


def whole(evidence, baseline, name, label):
    """Of a linear-Gaussian problem: the residual at the priors' mean, its covariance, and a cause's column."""
    cause = CAUSES[name]
    nothing = {p.name: p.null for p in cause.parameters(evidence, label)}
    problem = FitProblem(evidence, None, baseline, (CauseHypothesis(cause, label, nothing, {}),))
    weighed = problem.weighed()
    r, J = weighed.here.residual, weighed.here.jacobian
    own, column = J[:, : problem.count], J[:, problem.count]
    away = (problem.x0 - problem.mean)[: problem.count]
    spread = np.linalg.inv(problem.precision[: problem.count, : problem.count])
    return r + own @ away, np.eye(len(r)) + own @ spread @ own.T, column


@pytest.mark.parametrize("name", ["channel-gain", "drive-mass"])
def test_the_expected_gain_is_the_bayes_factor_and_the_size_that_of_least_squares(having, baseline, name):
    """No unknown is at a limit here, for a Gaussian has none."""
    label, values = SMALL[name]
    (law,) = baseline.laws
    baseline = replace(baseline, laws=(replace(law, loss=np.full(len(law.loss), 5e6)),))
    evidence = having(name, label, values, at=baseline, noise=3e-4)
    data, covariance, column = whole(evidence, baseline, name, label)
    score = labelled(scored(evidence, baseline, name), label)
    (main,) = CAUSES[name].parameters(evidence, label)
    with_it, without = (
        -0.5 * (data @ np.linalg.solve(C, data) + np.linalg.slogdet(C)[1])
        for C in (covariance + np.outer(column, column), covariance)
    )
    assert score.log_bayes == pytest.approx(with_it - without, rel=1e-3, abs=1e-2)
    weighed = np.linalg.solve(covariance, column)
    assert score.std == pytest.approx(main.scale / np.sqrt(weighed @ column), rel=1e-3)
    assert score.size == pytest.approx(main.scale * (weighed @ data) / (weighed @ column), rel=1e-3)


def density(evidence, baseline, errors, column):
    """Log density of the data, all unknowns integrated out, with the prior of these errors."""
    problem = FitProblem(evidence, None, baseline, (), errors=errors)
    weighed = problem.weighed()
    r, J = weighed.here.residual, weighed.here.jacobian
    made_of = problem.residual_model(problem.x0, weighed.held).linearisation(baseline, sensitivities=False).made_of
    volume = 2 * sum(white.log_determinant() for white in made_of.of_broadband(errors.broadband))
    volume += made_of.of_steps(errors.steps).log_determinant()
    C = np.eye(len(r)) + J @ np.linalg.solve(problem.precision, J.T)
    data = r + J @ (problem.x0 - problem.mean)
    with_it, without = (
        -0.5 * (data @ np.linalg.solve(C + more, data) + np.linalg.slogdet(C + more)[1] + volume)
        for more in (np.outer(column(weighed), column(weighed)), 0.0)
    )
    return with_it + log_prior(errors), without + log_prior(errors)


def test_a_large_effect_is_scored_with_the_errors_that_are_left_with_it(having, baseline):
    """Of sizes between those the model needs without it and a sound rig's: with the former it hardly counts."""
    label, values = SMALL["drive-mass"]
    (law,) = baseline.laws
    baseline = replace(baseline, laws=(replace(law, loss=np.full(len(law.loss), 5e6)),))
    evidence = having("drive-mass", label, values, at=baseline, noise=3e-4)
    needed = SOUND.with_log_sizes(SOUND.log_sizes + np.log([30, 30, 30, 30, 1, 1, 1, 1]))
    tolerant = {"drive-mass": Tolerated(CAUSES["drive-mass"], 0.0)}
    (score,) = score_causes(evidence, None, model_at(baseline), tolerant, errors=needed)[0]

    def column(weighed):
        (main,) = CAUSES["drive-mass"].parameters(evidence, label)
        little = modification_of(evidence, (CauseHypothesis(CAUSES["drive-mass"], label, {"mass_kg": -1e-6}, {}),))
        left = residual_model(evidence, little, held=weighed.held).evaluate(baseline, sensitivities=False).residual
        return (weighed.here.residual - left) * main.scale / -1e-6

    path = [SOUND.log_sizes + share * (needed.log_sizes - SOUND.log_sizes) for share in np.linspace(0, 1, 5)]
    sizes = [SOUND.with_log_sizes(log_sizes) for log_sizes in path]
    mixed = [replace(own, broadband=runs.broadband) for own in sizes for runs in sizes]
    with_it, without = np.max([density(evidence, baseline, errors, column) for errors in mixed], axis=0)
    assert score.log_bayes == pytest.approx(with_it - without, rel=0.02)
    assert score.log_bayes > np.diff(density(evidence, baseline, needed, column)[::-1])[0] + 10


def test_a_cause_of_a_size_that_sound_rigs_have_earns_nothing(having, baseline):
    """Of one that is known far better than that; were it not tolerated it would be named."""
    label = {"channel": "acc1"}
    evidence = having("channel-gain", label, {"factor": 1.0004})
    (main,) = CAUSES["channel-gain"].parameters(evidence, label)
    each = [scored(evidence, baseline, "channel-gain", tolerance=share) for share in (4e-4 / main.scale, 0.0)]
    tolerated, not_tolerated = (labelled(scores, label).log_bayes for scores in each)
    assert tolerated < 0 < 10 < not_tolerated


def with_law(baseline):
    """The base family with a joint that softens, so that harmonics add to it."""
    knots = choose_knots(np.array([1e-5]), 12)
    softening = -Saturating(1.5e8, 2e-6, -1.5e8).describing_function(knots).real
    return replace(baseline, laws=(LayerLaw(knots, knots, softening, 0.1 * softening),))


def test_another_mean_over_the_layer_s_elements_is_tolerated(measured, baseline, monkeypatch):
    """What it changes is what moduli, damping and law do, and what sound rigs differ in."""
    at = with_law(baseline)
    held = residual_model(measured, errors=SOUND).linearisation(at)
    monkeypatch.setattr(score_test, "law_tolerances", LAW_TOLERANCES)

    def residual(share):
        model = residual_model(measured, ModelModification(towards_middle={"joint": share}), held=held)
        return model.evaluate(at, sensitivities=False)

    change = residual(1e-3).residual - residual(0.0).residual
    assert norm(change) > 0.1
    unknowns = residual_model(measured, errors=SOUND, held=held).evaluate(at).jacobian
    columns = np.hstack([score_causes(measured, None, model_at(at), {})[1].whitened(held), unknowns])
    left = change - columns @ np.linalg.lstsq(columns, change)[0]
    assert norm(left) < 0.05 * norm(change)


def test_what_moduli_damping_and_law_do_within_their_limits_is_no_tolerance():
    rng = np.random.default_rng(3)
    names = ("log_E", "log_G", "loss_E", "frequency_discrepancy", "softening 0", "shown", "shifts")
    blocks = Blocks(tuple(zip(names, (1, 1, 1, 1, 3, 0, 0), strict=True)))
    J = rng.standard_normal((40, 7))
    bounds = np.array([-1.0, -1, 0, -1, -1, 0, -1]), np.ones(7)  # two losses at their limit
    start = SimpleNamespace(blocks=blocks)
    problem = SimpleNamespace(start=start, precision=1e-9 * np.eye(7), x0=np.zeros(7), bounds=bounds)
    vague, known = J[:, [0, 1, 4, 6]], J[:, [2, 3, 5]]
    columns = np.hstack([vague @ rng.standard_normal((4, 2)), known])
    left = score_test._beside_unknowns(columns, J, problem)
    np.testing.assert_allclose(left[:, :2], 0.0, atol=1e-6)
    np.testing.assert_allclose(left[:, 2:], known - vague @ np.linalg.lstsq(vague, known)[0], atol=1e-6)


def test_a_soft_joint_does_what_its_moduli_do_with_all_that_harmonics_add(measured, baseline):
    """Both are the same by definition; their harmonics alone are per cents of it."""
    at = with_law(baseline)
    causes = {"joint-stiffness": CAUSES["joint-stiffness"]}
    found = score_test._Signatures.at(measured, None, model_at(at), causes)
    (signature,), moduli = found.each, SCALE * found.weighed.here.jacobian[:, :2]
    assert (norm(signature.columns - moduli, axis=0) < 2e-4 * norm(moduli, axis=0)).all()
