"""A gain is measured where the data say something, and beside what a right model would leave."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.answer.comparison import predicted_harmonics, second_harmonic
from twin.diagnose.answer.gain import measure_gain
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import fit_model
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import fit_base
from twin.identify.measured_data import gather_data
from twin.identify.residuals.error_model import OF_SOFTENING
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

GAP = 0.4, 0.7
"""Of the largest amplitude, where nothing is learnt."""


@pytest.fixture(scope="module")
def data(campaign):
    rig = load_rig("steel-lap-joint")
    learnt = gather_data([read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], rig)
    return learnt, gather_data([read_run(campaign / "heldout.mcap")], rig)


def fitted(evidence, *, rougher=1.0):
    """The base family, with laws that many times as rough as a sound rig's."""
    start = fit_base(evidence)
    sizes = start.errors.log_sizes.copy()
    sizes[OF_SOFTENING:] += np.log(rougher)
    return fit_model(evidence, None, start.baseline, (), errors=start.errors.with_log_sizes(sizes))


def measured(learnt, unseen, model):
    return measure_gain((learnt, None), unseen, model, model, runs=("heldout.mcap",), sweeps=())


def in_gap(evidence, learnt):
    """Which steps."""
    share = evidence.steps.amplitude_m / np.max(learnt.steps.amplitude_m)
    return (share > GAP[0]) & (share < GAP[1])


def with_steps(evidence, numbers):
    return replace(evidence, steps=evidence.steps.select(numbers))


def test_a_right_model_leaves_what_is_expected_of_it(data):
    gain = measured(*data, fitted(data[0]))
    assert gain.by_harmonic[1].count == data[1].steps.response[:, :, 0].size
    assert 0.3 < gain.in_deviations[1] < 1.5
    assert gain.in_deviations[0] == gain.in_deviations[1]


def test_more_is_expected_between_the_amplitudes_that_were_learnt_from(data):
    learnt, unseen = data
    inside = with_steps(unseen, in_gap(unseen, learnt))
    assert len(inside.steps) > 1
    without = with_steps(learnt, ~in_gap(learnt, learnt))
    known, open_there = (measured(each, inside, fitted(each)).expected for each in (learnt, without))
    assert open_there > 2 * known


def test_a_rough_law_that_missed_the_gap_is_no_worse_than_expected(data):
    """Its error there is tens of times the noise, and says nothing against the model."""
    learnt, unseen = data
    some = with_steps(learnt, ~in_gap(learnt, learnt))
    gain = measured(some, unseen, fitted(some, rougher=1e3))
    assert gain.after > 10 * gain.noise_floor
    assert gain.in_deviations[1] < 1.5


def test_a_wrong_model_is_worse_than_expected(data):
    learnt, unseen = data
    model = fitted(learnt)
    softer = replace(model.baseline, base=replace(model.baseline.base, E=0.99 * model.baseline.base.E))
    gain = measured(learnt, unseen, replace(model, baseline=softer))
    assert gain.in_deviations[1] > 10


def test_of_a_stop_that_nothing_touched_before_any_second_harmonic_is_expected(data):
    """Sweeps that touched it tell its stiffness and gap, and what it will make of the next one."""
    learnt, unseen = data
    model = fitted(learnt)
    largest = np.max(unseen.steps.amplitude_m)
    values = {"stiffness_N_per_m": 200.0, "gap_m": 0.6 * largest, "position_m": load_rig("steel-lap-joint").length}
    stop = replace(model, hypotheses=(CauseHypothesis(CAUSES["ground-stop"], {}, values, {}),))
    harmonics = harmonic_residuals(ResidualModel(unseen), model.baseline)
    made = predicted_harmonics(unseen, stop, harmonics) - harmonics.residual
    response = unseen.steps.response.copy()
    response[:, :, 1] += second_harmonic(harmonics, made)
    struck = replace(unseen, steps=replace(unseen.steps, response=response))
    gains = [
        measure_gain((seen, None), struck, model, stop, runs=(), sweeps=())
        for seen in (learnt, with_steps(learnt, learnt.steps.amplitude_m < 0.5 * largest))
    ]
    assert gains[0].by_harmonic[2].count > 5
    assert gains[0].expected < 0.1
    assert gains[1].expected > 0.5
