"""What moduli that fall with time change in a prediction: the layer's alone, and all of them."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.model_modification import ModelModification
from twin.identify.residuals.residual_model import ResidualModel

pytestmark = pytest.mark.usefixtures("fundamentals_alone")


def test_a_drift_of_the_layer_takes_its_share_of_all_of_its_normal_modulus(evidence, baseline):
    """Of what the law takes off it too, at the same opening: E' - s(o) falls as a whole, and nothing else does."""
    steady, time = ResidualModel(evidence), evidence.steps.time_s
    drifting, left = ResidualModel(evidence, ModelModification(layer_drift_per_s={"joint": 2e-3})), 1 - 2e-3 * time
    assert left.min() < 0.85
    base, omega = baseline.base, evidence.steps.omega
    found = drifting.local.balance(baseline.laws, omega, drifting.surroundings(
        drifting.receptance(omega, base, time, inner=False, points=True), omega
    ))  # fmt: skip
    opening = np.abs(found.motion[:, :3])
    k = -steady.points.opening_weight * baseline.laws[0].softening_at(opening) * left[:, None]
    np.testing.assert_allclose(found.stiffness[:, :3], k, rtol=1e-6)
    dE, dG = drifting.moduli_changes(base, time)
    E = base.E * (1 + 1j * base.loss_E)
    np.testing.assert_allclose(E + dE[:, 0], E * left)
    np.testing.assert_allclose(dG, 0.0)
    loss = steady.points.slip_weight * baseline.laws[0].loss_at(np.abs(found.motion[:, 3:]))
    np.testing.assert_allclose(found.stiffness[:, 3:], 1j * loss, rtol=1e-6)


def test_where_all_moduli_have_fallen_the_law_feels_the_motion_that_was_measured(evidence, baseline):
    """K and the law fall to a part e: under F at omega the rig does what it did before under F / e at omega / sqrt(e).

    It moves as much, and shows 1 / e of the acceleration there, of which a motion at that frequency makes as much more.
    """
    left, steps = 0.9, evidence.steps
    late = replace(steps, time_s=np.full(len(steps), evidence.origin_s + 100.0))
    drifting = ResidualModel(
        replace(evidence, steps=late, begun_s=evidence.origin_s), ModelModification(beam_drift_per_s=1e-3)
    )
    undrifted = replace(
        steps, omega=steps.omega / np.sqrt(left), growth=steps.growth / np.sqrt(left), response=steps.response / left
    )
    steady = ResidualModel(replace(evidence, steps=undrifted))
    (R, _, found), (R_steady, _, expected) = (each.step_receptance(baseline) for each in (drifting, steady))
    np.testing.assert_allclose(found.motion, expected.motion, rtol=1e-9)
    np.testing.assert_allclose(R, R_steady, rtol=1e-9)


def test_a_shift_of_the_clock_is_a_shift_of_the_frequency(evidence, baseline):
    fast, omega = ModelModification(frequency_factor=1.001, beam_drift_per_s=1e-4), np.array([100.0, 200.0])
    clocked = ResidualModel(evidence, fast).clock(omega, np.array([0.0, 50.0]))
    np.testing.assert_allclose(clocked, omega * 1.001 / np.sqrt([1.0, 1 - 5e-3]), rtol=1e-12)
