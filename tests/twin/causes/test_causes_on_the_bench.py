"""What acts in the joint, forward model against harmonic balance of the bench: with a law and in a linear joint."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from twin.bench import BenchSetup, no_law, open_bench
from twin.bench.layer import law_from_table
from twin.diagnose.models import CAUSES
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import describing_function
from twin.response import HarmonicBalance
from twin.rigs import Effect, LayerLawTable

FREQUENCIES_Hz = {1: np.linspace(26.9, 25.7, 13), 2: np.linspace(159.0, 153.0, 13)}
FORCE_N = {1: 3.0, 2: 2.0}
MOTION_m = np.geomspace(1e-8, 2e-5, 40)
SOFTENING = 2e8 * MOTION_m / (MOTION_m + 2e-6)
LOSS = 2e9 * MOTION_m**2 / (MOTION_m**2 + 4e-12)


@pytest.fixture(scope="module")
def recorded(by_hand):
    """Steps of a bench with an effect, on the model's own mesh; and the joint's own law."""

    def record(name, parameters, *, law, mode=1):
        rig, E = by_hand.rig, by_hand.rig.joint.preload["120N"].normal_modulus
        table = LayerLawTable(opening_m=MOTION_m, softening=SOFTENING, slip_m=MOTION_m, loss=LOSS)
        joint_law = law_from_table(table, E=E) if law else no_law()
        bench, sound = (
            open_bench(
                rig,
                effects=effects,
                joint_law=joint_law,
                setup=BenchSetup(drive="force", noise=False, converter=False, layout=rig.layout()),
            )
            for effects in ([Effect(cause=name, parameters=parameters)], [])
        )
        balance = HarmonicBalance(bench.built, harmonics=15, samples=1024)
        sweep = balance.sweep(FREQUENCIES_Hz[mode], FORCE_N[mode])
        assert not sweep.failures
        names = [channel.name for channel in bench.channels]
        channels = by_hand.outputs[:2]
        read = np.array([step.channels for step in sweep])
        force = read[:, names.index("force"), 1]
        measured = read[:, [names.index(output.channel) for output in channels]]
        evidence = by_hand.evidence(
            2 * np.pi * FREQUENCIES_Hz[mode],
            measured[:, :, 1] / force[:, None],
            force=force,
            with_harmonics=measured[:, :, 2:8],
            channels=channels,
        )
        knots = choose_knots(np.array([6e-6]), 40)
        shown = sound.built.laws[0]
        loss = shown.loss.describing_function(knots).imag if shown.loss else 0 * knots
        layer = LayerLaw(knots, knots, -describing_function(shown.normal.force_history, knots).real, loss)
        return SimpleNamespace(evidence=evidence, baseline=BaselineParameters(nominal_parameters(rig), (layer,)))

    return record


def errors(case, modification=None):
    """Of the complex responses at every step, relative."""
    residual_model = ResidualModel(case.evidence, modification)
    steps = case.evidence.steps
    R, omega, _ = residual_model.step_receptance(case.baseline)
    return np.abs(residual_model.responses(R, omega) * steps.force[:, :1] / steps.response[:, :, 0] - 1)


def named(case, name, parameters):
    """The cause as it was hidden."""
    label = {key: value for key, value in parameters.items() if isinstance(value, str)}
    values = {key: value for key, value in parameters.items() if key not in label}
    cause = CAUSES[name]
    return cause.modification(case.evidence, label, cause.from_reported(values))


@pytest.mark.parametrize("mode", [1, 2])
@pytest.mark.parametrize("element", ["1", "3"])
def test_a_slider_on_either_end_of_the_joint(recorded, element, mode):
    """It sticks in some steps and slips in others, in a layer that softens and loses beside it."""
    hidden = {"layer_element": element, "stiffness_N_per_m": 2e8, "slip_force_N": 40.0}
    case = recorded("joint-friction", hidden, law=True, mode=mode)
    left, without = errors(case, named(case, "joint-friction", hidden)), errors(case)
    assert np.max(without) > 0.3
    assert np.max(left) < 0.04 * np.max(without)
    # The middle, which slips less, would have to be another slider.
    assert np.max(errors(case, named(case, "joint-friction", {**hidden, "layer_element": "2"}))) > 3 * np.max(left)


@pytest.mark.parametrize("mode", [1, 2])
def test_a_layer_that_is_uneven_softens_unevenly(recorded, mode):
    """A law takes the same share off each modulus."""
    case = recorded("joint-uneven", {"gradient": 0.6}, law=True, mode=mode)
    left, without = errors(case, named(case, "joint-uneven", {"gradient": 0.6})), errors(case)
    assert np.max(without) > 0.05
    assert np.max(left) < 0.02 * np.max(without)


@pytest.mark.parametrize("gap_m", [5e-7, 1.5e-6])
def test_lost_contact_bends_the_fundamental_and_has_even_harmonics(recorded, gap_m):
    """Even motion lowers the fundamental's stiffness in turn, which no law of its amplitude alone can say."""
    hidden = {"gap_m": gap_m, "stiffness_factor": 0.6}
    case = recorded("joint-slap", hidden, law=False)
    modification = named(case, "joint-slap", hidden)
    assert np.max(errors(case, modification)) < 0.05 * np.max(errors(case))
    residual_model = ResidualModel(
        case.evidence, modification, harmonic_residuals(ResidualModel(case.evidence), case.baseline)
    )
    R, _, balance = residual_model.step_receptance(case.baseline)
    found = residual_model.extra_harmonics(case.baseline, R, balance)
    for h in (2, 4, 6):
        measured = case.evidence.steps.response[:, :, h - 1]
        assert np.linalg.norm(found[:, h - 2] - measured) < LIMITS.even_error * np.linalg.norm(measured)
    assert not np.any(found[:, [1, 3, 5]])
