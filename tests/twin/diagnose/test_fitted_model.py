"""A model on trial: what its causes do together, and its sensitivities to them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, modification_of
from twin.diagnose.fitted_model import FitOptions, fit_model
from twin.diagnose.models import CAUSES
from twin.identify.base_fit import fit_base
from twin.identify.measured_data import gather_data
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig


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
    baseline = fit_base(evidence).baseline
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
    weighed = trial.weighed()
    columns = weighed.here.jacobian[:, trial.count :]
    for k, (_, parameter) in enumerate(trial.slots):
        step = np.zeros(len(trial.x0))
        step[trial.count + k] = 3e-4
        there, back = (weighed.predict(trial.x0 + side * step).residual for side in (1, -1))
        expected = (back - there) / (2 * 3e-4)
        assert np.linalg.norm(columns[:, k] - expected) <= 0.05 * np.linalg.norm(expected), parameter.name


@pytest.mark.parametrize(
    ("name", "values", "parameter", "limit"),
    [
        ("cubic-stiffness", {"stiffness_N_per_m3": 3e6, "position_m": 0.38}, "stiffness_N_per_m3", 1e-4),
        ("cubic-stiffness", {"stiffness_N_per_m3": 3e6, "position_m": 0.38}, "position_m", 1e-4),
        ("joint-slap", {"stiffness_factor": 0.8, "gap_m": 3e-7}, "gap_m", 1e-2),
        ("joint-slap", {"stiffness_factor": 0.8, "gap_m": 3e-7}, "stiffness_factor", 1e-2),
        ("joint-slap", {"stiffness_factor": 0.8, "gap_m": 3e-7}, "log_E", 1e-3),
    ],
)
def test_sensitivities_contain_what_harmonics_do_to_the_joint(fitted_recordings, name, values, parameter, limit):
    """A cubic spring's stiffness and place make up for each other but for a thousandth: that decides where it is."""
    evidence, harmonics, baseline = fitted_recordings
    label = next(iter(CAUSES[name].labels(evidence)))
    trial = FitProblem(evidence, harmonics, baseline, (CauseHypothesis(CAUSES[name], label, values, {}),))
    weighed = trial.weighed()
    weights = {kind: getattr(weighed.held, kind) for kind in ("broadband", "steps")}
    numbers = {p.name: trial.count + k for k, (_, p) in enumerate(trial.slots)}
    number = numbers.get(parameter, trial.start.blocks["log_E"].start)
    column, step, balanced = weighed.here.jacobian[:, number], 3e-4 * np.eye(len(trial.x0))[number], []
    for side in (1, -1):
        there = trial.x0 + side * step
        held = trial.weighed(there).held  # fundamentals and harmonics in balance there
        modification = modification_of(evidence, trial.hypotheses(there))
        model = ResidualModel(evidence, modification, harmonics, held=replace(held, **weights))
        balanced.append(model.evaluate(trial.baseline(there), sensitivities=False).residual)
    expected, steps = (balanced[1] - balanced[0]) / (2 * 3e-4), dict(weighed.here.blocks)["steps"]
    assert np.linalg.norm((column - expected)[steps]) < limit * np.linalg.norm(expected[steps])


def test_causes_that_are_frozen_keep_their_values_and_moduli_their_own(fitted_recordings):
    """A soft joint shares its product with the moduli where both are free: frozen, it is no one's to share."""
    evidence, harmonics, baseline = fitted_recordings
    values = {"log_normal_factor": -0.2, "log_shear_factor": -0.4}
    given = (CauseHypothesis(CAUSES["joint-stiffness"], {}, values, {}),)
    frozen = fit_model(evidence, harmonics, baseline, given, options=FitOptions(iterations=0, rounds=0, frozen=True))
    assert frozen.hypotheses[0].values == values
    np.testing.assert_array_equal(frozen.baseline.vector, baseline.vector)
    free = fit_model(evidence, harmonics, baseline, given, options=FitOptions(iterations=0, rounds=0))
    assert free.hypotheses[0].values["log_shear_factor"] != values["log_shear_factor"]
