"""Limits of what the data could hide, from the sizes that scores give and their standard deviations."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.answer.exclusion import exclusion_limits, hidden_at_limit
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.limits import LIMITS
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE
from twin.diagnose.selection.score_test import Score
from twin.identify.measured_data import gather_data
from twin.rigs import load_rig

Z_95 = 1.645
OCCAM = 3.0
"""Nats that a cause costs by what its prior holds beside the estimate."""


@pytest.fixture(scope="module")
def evidence(campaign):
    return gather_data([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))


def score(name, size, std, label=None, **values):
    log_bayes = size**2 / std**2 / 2 - OCCAM
    return Score(CauseHypothesis(CAUSES[name], label or {}, values, {}), size, std, log_bayes, np.zeros(0))


def detected(evidence, name, std):
    """The estimate that just makes a cause as probable as none, and on top what noise takes off 5 of 100."""
    shared_out = len(CAUSES[name].labels(evidence))
    gain = LIMITS.posterior_temperature * (np.log(shared_out) - LOG_ODDS_OF_A_CAUSE)
    return (np.sqrt(2 * (gain + OCCAM)) + Z_95) * std


def mass(size, std, position_m=0.3):
    return score("added-mass", size, std, mass_kg=0.01, position_m=position_m)


def test_a_true_size_lies_below_its_limit_in_19_of_20_recordings(evidence):
    """Whatever it is: of estimates that scatter about it by their standard deviation."""
    true, std = 5e-5, 2e-5
    estimates = true + std * np.random.default_rng(5).standard_normal(2000)
    limits = [exclusion_limits(evidence, [mass(size, std)])[0].limit_95 for size in estimates]
    assert np.mean(np.array(limits) > true) > 0.95


def test_what_is_as_large_as_the_limit_is_named_in_19_of_20_recordings(evidence):
    std = 2e-5
    (limit,) = exclusion_limits(evidence, [mass(0.0, std)])
    estimates = limit.limit_95 + std * np.random.default_rng(6).standard_normal(2000)
    named = [mass(size, std).log_bayes / LIMITS.posterior_temperature + LOG_ODDS_OF_A_CAUSE > 0 for size in estimates]
    assert np.mean(named) == pytest.approx(0.95, abs=0.015)


def test_a_size_below_nothing_still_leaves_what_noise_could_hide(evidence):
    """No dashpot is negative; a gain is off either way."""
    damper = score("viscous-damper", -3e-3, 1e-3, damping_Ns_per_m=0.01, position_m=0.3)
    assert exclusion_limits(evidence, [damper])[0].limit_95 == pytest.approx(detected(evidence, "viscous-damper", 1e-3))
    (of_gain,) = exclusion_limits(evidence, [score("channel-gain", -2e-2, 1e-3, {"channel": "acc1"}, factor=1.0)])
    assert of_gain.limit_95 == pytest.approx(2e-2 + Z_95 * 1e-3)
    assert (of_gain.cause, of_gain.parameter, of_gain.where) == ("channel-gain", "factor", {"channel": "acc1"})


def test_the_limit_is_that_of_the_place_where_the_cause_hides_best(evidence):
    scores = [mass(1e-6, 1e-6, 0.42), mass(0.0, 8e-5, 0.05), mass(0.0, 4e-5, 0.2)]
    (limit,) = exclusion_limits(evidence, scores)
    assert limit.limit_95 == pytest.approx(detected(evidence, "added-mass", 8e-5))
    assert limit.where == {"position_m": 0.05}


def test_a_place_where_any_size_could_hide_leaves_no_limit(evidence):
    (limit,) = exclusion_limits(evidence, [mass(0.0, np.inf, 0.01), mass(0.0, 1e-6)])
    assert limit.limit_95 is None
    assert limit.where == {"position_m": 0.01}


def test_the_tightest_limit_comes_first_by_the_usual_size_of_its_cause(evidence):
    """A channel's gain is known to a part in ten thousand where a mass may be a gram."""
    gain = score("channel-gain", 0.0, 1e-4, {"channel": "acc1"}, factor=1.0)
    sign = score("channel-polarity", 0.0, np.inf, {"channel": "acc1"})
    limits = exclusion_limits(evidence, [mass(0.0, np.inf), sign, mass(0.0, 1e-3), gain])
    assert [limit.cause for limit in limits] == ["channel-gain", "added-mass"]


def test_what_could_hide_is_as_large_as_the_limit_says_and_of_its_usual_size_without_one(evidence):
    tight = hidden_at_limit(evidence, [mass(0.0, 1e-6, 0.42), mass(0.0, 8e-5, 0.05)], "added-mass")
    assert tight.values == pytest.approx({"mass_kg": detected(evidence, "added-mass", 8e-5), "position_m": 0.05})
    loose = hidden_at_limit(evidence, [mass(0.0, np.inf, 0.01)], "added-mass")
    usual = {p.name: p.scale for p in CAUSES["added-mass"].parameters(evidence, {})}
    assert loose.values["mass_kg"] == usual["mass_kg"]
    assert hidden_at_limit(evidence, [mass(0.0, 1e-6)], "channel-gain") is None
