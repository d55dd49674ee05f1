"""Causes are added one by one while the odds are for one more: on recordings of a rig whose moduli alone are off."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.cause import Cause
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE
from twin.diagnose.selection import search
from twin.diagnose.selection.rivals import fitted_rivals
from twin.diagnose.selection.search import search_causes
from twin.diagnose.verdict import decide, posterior_of
from twin.identify.measured_data import gather_data
from twin.identify.model_modification import ModelModification
from twin.identify.time_limit import time_limit
from twin.rigs import load_rig

NAMES, CHANNEL = ("channel-gain", "added-mass"), "acc1"


class Gain(Cause):
    """A channel reads too much, and is late by so much for each unit of it."""

    summary = "a channel reads too much"
    numbers = CAUSES["channel-gain"].numbers

    def __init__(self, name, late_s=0.0):
        self.name, self.late_s = name, late_s

    def modification(self, evidence, label, values):
        factor, late_s = values["factor"], self.late_s * (values["factor"] - 1)
        return ModelModification(channel_factor={CHANNEL: lambda omega: factor * np.exp(-1j * omega * late_s)})


@pytest.fixture(scope="module")
def searched(campaign):
    """Searches the recordings as they are, or with a channel that reads too much."""

    def searched(factor):
        runs = [_reading(read_run(campaign / f"{name}.mcap"), factor) for name in ("random", "sweeps")]
        evidence = gather_data(runs, load_rig("steel-lap-joint"))
        return search_causes(evidence, {name: CAUSES[name] for name in NAMES})

    return searched


def _reading(run, factor):
    device = run.device_of(CHANNEL)
    changed = replace(device, values={**device.values, CHANNEL: factor * device.values[CHANNEL]})
    return replace(run, devices={**run.devices, device.device: changed})


def test_a_clean_rig_costs_no_fit_and_has_nothing_named(searched):
    found = searched(1.0)
    (stage,) = found.stages
    assert not stage.accepted
    assert stage.rivals == ()
    assert found.model.hypotheses == ()
    assert max(score.log_bayes for score in stage.scores) < -LOG_ODDS_OF_A_CAUSE
    assert decide(posterior_of(found), []) == "none"


def test_where_the_time_is_up_nothing_is_named_and_something_may_be(searched):
    with time_limit(time.monotonic()):
        found = searched(1.03)
    assert not found.complete
    assert found.model.hypotheses == ()
    assert decide(posterior_of(found), []) == "unknown"


@pytest.mark.slow
def test_a_channel_that_reads_too_much_is_taken_and_then_nothing_more(searched):
    found = searched(1.03)
    assert [stage.accepted for stage in found.stages] == [True, False]
    (hypothesis,) = found.model.hypotheses
    assert hypothesis.key == f"channel-gain {CHANNEL}"
    assert hypothesis.values["factor"] == pytest.approx(1.03, abs=1e-3)
    assert found.stages[0].rivals[0].log_evidence > found.stages[0].before.log_evidence + 10
    assert found.stages[1].before.name == "channel-gain"
    assert decide(posterior_of(found), []) == "explained"


def test_what_stood_for_a_cause_is_dropped_once_the_cause_is_found(campaign, monkeypatch):
    """As where the cause's own fit has ended in another maximum in the first turn."""
    turns = []

    def at_first_without_the_right_one(race, model, before, scores, if_sound, report):
        turns.append(model.name)
        passed_over = {"right"} if len(turns) == 1 else set()

        def left(scores):
            return [score for score in scores if score.hypothesis.cause.name not in passed_over]

        return fitted_rivals(race, model, before, left(scores), lambda: left(if_sound()), report)

    monkeypatch.setattr(search, "fitted_rivals", at_first_without_the_right_one)
    evidence = gather_data([_reading(read_run(campaign / "random.mcap"), 1.05)], load_rig("steel-lap-joint"))
    found = search_causes(evidence, {cause.name: cause for cause in (Gain("wrong", 3e-4), Gain("right"))})
    assert [stage.best.name for stage in found.stages] == ["wrong", "wrong + right", "right", "right"]
    assert found.model.hypotheses[0].values["factor"] == pytest.approx(1.05, abs=1e-3)
    posterior = posterior_of(found)
    assert decide(posterior, []) == "explained"
    assert posterior.set_95 == ("right",)
