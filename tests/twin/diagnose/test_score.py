"""The score test's first order against refits, and against what the unknowns can explain by themselves."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.candidate import Blame, Candidate, extension_of, fit_candidate
from twin.diagnose.models import CAUSES
from twin.diagnose.score import score_causes
from twin.diagnose.thin import thin_evidence
from twin.identify.evidence import gather_evidence
from twin.identify.joint_law import LayerLaw, choose_knots
from twin.identify.linear_model import believed_parameters
from twin.identify.prediction import Predictor
from twin.identify.unknowns import Unknowns
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


@pytest.fixture(scope="module")
def measured(campaign):
    """Frequencies, forces and noise of real recordings, thinned."""
    evidence = gather_evidence([read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], RIG)
    return thin_evidence(evidence, None, bins=70, steps=18)[0]


@pytest.fixture(scope="module")
def unknowns(measured):
    """What is believed, some loss in the joint so that its limit at zero is far, and no nonlinear law."""
    base = replace(believed_parameters(RIG), loss_E=0.02, loss_G=0.05)
    knots = choose_knots(np.array([1e-5]), 4)
    return Unknowns(base, (LayerLaw.zero(knots, knots),))


@pytest.fixture(scope="module")
def having(measured, unknowns):
    """Builds evidence in which all responses are those of the model with a cause, with noise or without."""

    def having(name="", label=None, values=None, *, at=None, noise=0.0):
        at = at or unknowns
        blames = (Blame(CAUSES[name], label or {}, values, {}),) if name else ()
        predictor = Predictor(measured, extension_of(measured, blames))
        rng = np.random.default_rng(12)

        def noisy(H):
            return H * (1 + noise * (rng.standard_normal(H.shape) + 1j * rng.standard_normal(H.shape)))

        (data,) = measured.broadband
        rest = np.zeros(len(data.omega))
        R = predictor.receptance(data.omega, at.base, rest)
        bins = replace(data, H=noisy(predictor.responses(R, data.omega)))
        response = measured.steps.response.copy()
        response[:, :, 0] = noisy(predictor.responses(*predictor.step_receptance(at)[:2])) * measured.steps.force[:, :1]
        return replace(measured, broadband=(bins,), steps=replace(measured.steps, response=response))

    return having


def model_at(unknowns):
    """The base family at these unknowns."""
    return Candidate((), unknowns, cast("Any", None), 0.0, 1)


def scored(evidence, unknowns, *names):
    """Scores of some causes beside the base family at the unknowns."""
    return score_causes(evidence, None, model_at(unknowns), {name: CAUSES[name] for name in names})


SMALL = {
    "drive-mass": ({}, {"mass_kg": -1e-3}),
    "stinger-stiffness": ({}, {"stiffness_N_per_m": 6000.0}),
    "base-motion": ({}, {"receptance_m_per_N": 2e-9}),
    "channel-gain": ({"channel": "acc1"}, {"factor": 1.004}),
    "cross-talk": ({"channel": "acc1", "source": "acc2"}, {"factor": 1e-3}),
    "joint-uneven": ({}, {"gradient": 0.15}),
}
"""Effects well above the noise, and so small that they are linear."""


def refitted(evidence, unknowns, *blames):
    """The base family with these causes at its minimum."""
    return fit_candidate(evidence, None, unknowns, blames, iterations=50, tolerance=1e-7)


@pytest.mark.parametrize("name", SMALL)
def test_the_first_orders_gain_is_that_of_a_refit(having, unknowns, name):
    """Both with the prior's part of the cost; the data have noise beside the effect."""
    label, values = SMALL[name]
    evidence = having(name, label, values, noise=3e-4)
    base = refitted(evidence, unknowns)
    (score,) = [s for s in scored(evidence, base.unknowns, name) if s.blame.label == label]
    refit = refitted(evidence, base.unknowns, score.blame)
    fall = base.solution.cost - refit.solution.cost
    assert fall > 20
    assert score.gain == pytest.approx(fall, rel=0.03)
    ((strength, _),) = values.items()
    null = CAUSES[name].parameters(evidence, label)[0].null
    assert score.blame.values[strength] - null == pytest.approx(refit.blames[0].values[strength] - null, rel=0.15)


def test_what_the_unknowns_can_explain_is_no_causes_gain(having, unknowns):
    """E' off by a hundredth, nothing refitted: a factor on E' would take it all, had E' not been unknown anyway."""
    base = unknowns.base
    evidence = having(at=replace(unknowns, base=replace(base, E=1.01 * base.E)))
    chi2 = Predictor(evidence).evaluate(unknowns, sensitivities=False).chi2
    (score,) = scored(evidence, unknowns, "joint-stiffness")
    extension = CAUSES["joint-stiffness"].extension(
        evidence, {}, {"log_normal_factor": np.log(1.01), "log_shear_factor": 0.0}
    )
    assert Predictor(evidence, extension).evaluate(unknowns, sensitivities=False).chi2 < 1e-3 * chi2
    assert chi2 > 100
    assert score.gain < 1e-3 * chi2


def test_a_sound_rig_gives_no_cause_anything(having, unknowns):
    """Not even where it begins: nothing is left to explain."""
    linear = [name for name in CAUSES if name not in ("channel-polarity", "transverse-shear")]
    assert max(score.gain for score in scored(having(), unknowns, *linear)) < 1e-2


@pytest.mark.parametrize("place", [0.30, 0.12])
def test_the_best_place_is_where_the_mass_sits(having, unknowns, place):
    evidence = having("added-mass", {}, {"mass_kg": 2e-4, "position_m": place})
    base = refitted(evidence, unknowns)
    scores = scored(evidence, base.unknowns, "added-mass")
    assert [s.gain for s in scores] == sorted((s.gain for s in scores), reverse=True)
    starts = next(p.starts for p in CAUSES["added-mass"].parameters(evidence, {}) if p.name == "position_m")
    assert len(scores) == len(starts)
    assert scores[0].blame.values["position_m"] == pytest.approx(place)
    assert all(np.linalg.norm(s.column) == pytest.approx(1.0) for s in scores)


def test_a_cause_gains_nothing_beyond_its_limits(having, unknowns):
    """Less damping than believed, by a detour: no dashpot is negative."""
    evidence = having("viscous-damper", {}, {"damping_Ns_per_m": -0.02, "position_m": 0.2})
    scores = scored(evidence, unknowns, "viscous-damper")
    assert all(s.blame.values["damping_Ns_per_m"] >= 0 for s in scores)
    best = next(s for s in scores if s.blame.values["position_m"] == pytest.approx(0.21))
    assert best.gain == pytest.approx(0.0, abs=1e-9)


def test_a_cause_is_scored_beside_those_already_blamed(having, unknowns):
    """Once the gain is blamed the delay is what is left, and is scored without the gain's part."""
    label = {"channel": "acc1"}
    evidence = having("channel-gain", label, {"factor": 1.05})
    blamed = replace(model_at(unknowns), blames=(Blame(CAUSES["channel-gain"], label, {"factor": 1.05}, {}),))
    left = score_causes(evidence, None, blamed, {"cross-talk": CAUSES["cross-talk"]})
    alone = scored(evidence, unknowns, "cross-talk")
    assert max(s.gain for s in alone) > 100
    assert max(s.gain for s in left) < 1e-2


SHARP = {
    "clamp-compliance": ({}, {"rotational_rad_per_Nm": 3e-7}),
    "beam-modulus": ({"beam": "lower"}, {"factor": 0.999}),
}


@pytest.mark.parametrize("name", SHARP)
def test_the_first_order_holds_within_a_resonances_width(having, unknowns, name):
    label, values = SHARP[name]
    evidence = having(name, label, values, noise=3e-4)
    base = refitted(evidence, unknowns)
    (score,) = [s for s in scored(evidence, base.unknowns, name) if s.blame.label == label]
    refit = refitted(evidence, base.unknowns, score.blame)
    assert score.gain == pytest.approx(base.solution.cost - refit.solution.cost, rel=0.05)


def test_a_small_mass_at_the_tip_is_placed_at_the_tip(having, unknowns):
    evidence = having("added-mass", {}, {"mass_kg": 2e-4, "position_m": 0.42})
    base = refitted(evidence, unknowns)
    best = scored(evidence, base.unknowns, "added-mass")[0]
    assert best.blame.values["position_m"] == pytest.approx(0.42)
    assert best.blame.values["mass_kg"] == pytest.approx(2e-4, rel=0.1)


def test_a_delay_that_the_losses_may_not_explain_gains_all_of_it(having, unknowns):
    label, values = {"channel": "acc2"}, {"delay_s": 2e-6}
    evidence = having("channel-delay", label, values, noise=3e-4)
    base = refitted(evidence, unknowns)
    assert base.unknowns.base.loss_E == 0.0
    (score,) = [s for s in scored(evidence, base.unknowns, "channel-delay") if s.blame.label == label]
    refit = refitted(evidence, base.unknowns, score.blame)
    assert score.gain == pytest.approx(base.solution.cost - refit.solution.cost, rel=0.05)
