"""Errors of models beside sweeps whose errors are made by hand."""

from __future__ import annotations

from dataclasses import replace
from typing import Any, cast

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.answer.comparison import compare_sweeps, noise_floors, predicted_steps, relative_errors
from twin.diagnose.fit_problem import CauseHypothesis, modification_of
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import starting_baseline
from twin.identify.measured_data import gather_data
from twin.identify.residuals.error_model import SOUND
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

NOISE = 1e-4
"""Relative standard deviation of every response and of the force."""


@pytest.fixture(scope="module")
def learnt(campaign):
    evidence = gather_data([read_run(campaign / "sweeps.mcap")], load_rig("steel-lap-joint"))
    return evidence, starting_baseline(evidence)


def fitted_model(baseline, *hypotheses):
    """A model at these unknowns; how it was fitted does not matter here."""
    return FittedModel(hypotheses, baseline, SOUND, cast("Any", None), 0.0, 100)


@pytest.fixture(scope="module")
def by_hand(learnt):
    """Builds evidence in which a model at the unknowns is off by given relative errors, and its residual harmonics.

    The reference channel moves as it was measured, for everything else goes by that; force and other channels follow.
    """
    evidence, baseline = learnt
    reference, steps = evidence.reference, evidence.steps
    moved = np.zeros_like(steps.response)
    moved[:, reference, 0] = steps.response[:, reference, 0]
    quiet = replace(
        steps,
        response=moved,
        force=np.zeros_like(steps.force),
        force_variance=np.ones_like(steps.force_variance),
        growth=np.zeros(len(steps)),
    )
    predicted = predicted_steps(replace(evidence, steps=quiet), fitted_model(baseline))

    def make(errors, second=0.0):
        force, response = quiet.force.copy(), np.zeros_like(steps.response)
        force[:, 0] = moved[:, reference, 0] * (1 + errors[:, reference]) / predicted[:, reference]
        response[:, :, 0] = predicted * force[:, :1] / (1 + errors)
        response[:, :, 1] = second
        made = replace(
            quiet,
            response=response,
            response_variance=np.repeat((NOISE * np.abs(response[:, :, :1])) ** 2, response.shape[2], axis=2),
            force=force,
            force_variance=np.repeat((NOISE * np.abs(force[:, :1])) ** 2, force.shape[1], axis=1),
        )
        whole = replace(evidence, steps=made)
        return whole, harmonic_residuals(ResidualModel(whole), baseline)

    return make


def test_errors_are_those_that_were_made(by_hand, learnt):
    """Complex ones: a wrong phase is an error as a wrong size is."""
    shape = (len(learnt[0].steps), 2)
    rng = np.random.default_rng(6)
    errors = 0.05 * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))
    evidence, harmonics = by_hand(errors)
    found = relative_errors(evidence, fitted_model(learnt[1]), harmonics)
    assert set(found) == {1}
    assert found[1] == pytest.approx(np.abs(errors).ravel())


def test_a_model_with_the_cause_that_made_them_has_none(by_hand, learnt):
    shape = (len(learnt[0].steps), 2)
    evidence, harmonics = by_hand(np.tile([1 / 1.07 - 1, 0.0], (shape[0], 1)))
    gain = CauseHypothesis(CAUSES["channel-gain"], {"channel": "acc1"}, {"factor": 1.07}, {})
    before, after = (relative_errors(evidence, model, harmonics)[1] for model in models(learnt[1], gain))
    assert before.reshape(shape)[:, 0] == pytest.approx(np.full(shape[0], 0.07 / 1.07))
    assert np.max(after) < 1e-9


def models(baseline, hypothesis):
    """The base family, and with a cause."""
    return fitted_model(baseline), fitted_model(baseline, hypothesis)


def test_second_harmonics_are_held_against_a_model_where_they_stand_out(by_hand, learnt):
    """Nine times the noise is too little to judge by, eleven is enough; a model that makes none misses all of it."""
    count = len(learnt[0].steps)
    plain, _ = by_hand(np.zeros((count, 2)))
    size = NOISE * np.abs(plain.steps.response[:, :, 0])
    clear = np.zeros((count, 2), bool)
    clear[::3, 1] = True
    evidence, harmonics = by_hand(np.zeros((count, 2)), second=np.where(clear, 11.0, 9.0) * size)
    found, floors = relative_errors(evidence, fitted_model(learnt[1]), harmonics), noise_floors(evidence, harmonics)
    assert len(found[2]) == len(floors[2]) == clear.sum()
    assert found[2] == pytest.approx(np.ones(clear.sum()))
    assert floors[2] == pytest.approx(np.full(clear.sum(), 1 / 11))


def test_second_harmonics_that_a_cause_predicts_are_no_error(by_hand, learnt):
    """Measured as a stop makes them but for a tenth."""
    evidence, baseline = learnt
    count = len(evidence.steps)
    values = {"stiffness_N_per_m": 300.0, "gap_m": 1e-5, "position_m": 0.25}
    stop = CauseHypothesis(CAUSES["ground-stop"], {}, values, {})
    plain, harmonics = by_hand(np.zeros((count, 2)))
    residual_model = ResidualModel(plain, modification_of(plain, (stop,)), harmonics)
    R, _, balance = residual_model.step_receptance(baseline)
    made = residual_model.extra_harmonics(baseline, R, balance)[:, harmonics.orders == 2][:, 0]
    evidence, harmonics = by_hand(np.zeros((count, 2)), second=made / 1.1)
    before, after = (relative_errors(evidence, model, harmonics)[2] for model in models(baseline, stop))
    assert len(after) > 0.9 * 2 * count
    assert before == pytest.approx(np.ones(len(before)))
    assert after == pytest.approx(np.full(len(after), 0.1), rel=1e-6)


def test_the_noise_floor_is_that_of_response_and_force(by_hand, learnt):
    count = len(learnt[0].steps)
    evidence, harmonics = by_hand(np.zeros((count, 2)))
    assert noise_floors(evidence, harmonics)[1] == pytest.approx(np.full(2 * count, np.sqrt(2) * NOISE))


def test_a_perfect_models_errors_are_its_noise_floor(by_hand, learnt):
    """Noise drawn as stated, in place of errors: the root mean squares agree."""
    count = len(learnt[0].steps)
    rng = np.random.default_rng(9)

    def draw(*shape):
        return NOISE * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2)

    evidence, harmonics = by_hand(draw(count, 2) + draw(count, 1))
    found, floor = (
        relative_errors(evidence, fitted_model(learnt[1]), harmonics)[1],
        noise_floors(evidence, harmonics)[1],
    )
    assert np.sqrt(np.mean(found**2)) == pytest.approx(np.sqrt(np.mean(floor**2)), rel=0.2)


def test_sweeps_are_compared_one_by_one_in_units_of_their_noise(by_hand, learnt):
    count = len(learnt[0].steps)
    evidence, _ = by_hand(np.tile([1 / 1.07 - 1, 0.0], (count, 1)))
    gain = CauseHypothesis(CAUSES["channel-gain"], {"channel": "acc1"}, {"factor": 1.07}, {})
    sweeps = compare_sweeps(evidence, *models(learnt[1], gain))
    assert [sweep.sweep for sweep in sweeps] == list(dict.fromkeys(state.sweep for state in evidence.steps.states))
    assert sum(len(sweep.frequency_Hz) for sweep in sweeps) == count
    for sweep in sweeps:
        level = float(sweep.sweep.split("N")[0])
        assert np.median(sweep.force_N) == pytest.approx(level, rel=0.05)
        assert sweep.channels == ("acc1", "acc2")
        assert sweep.before[:, 0] * 1.07 == pytest.approx(sweep.measured[:, 0])
        assert sweep.after == pytest.approx(sweep.measured)
        assert sweep.residual_before[:, 0] == pytest.approx(
            np.full(len(sweep.force_N), 0.07 / 1.07 / NOISE / np.sqrt(2))
        )
        assert np.max(sweep.residual_after) < 1e-6
