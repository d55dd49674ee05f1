"""A shaker unlike the rig file's, told by force and response at harmonics whose sizes a filter leaves unknown."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward.shaker_impedance import drive_stiffness
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.opening_harmonics import balance_openings
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import Saturating
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
HEAVY = STEEL.drive.model_copy(update={"amplifier": "current", "armature_mass": 0.05})
OTHER = STEEL.model_copy(update={"drive": HEAVY})
THIRD = 2
"""Where the third harmonic is."""


@pytest.fixture(scope="module")
def measured(build, steel_model):
    """Steps about mode 2 at a rig with the other shaker, with the third harmonic behind a filter; and its stiffness."""
    knots = np.geomspace(1e-9, 1e-5, 60)
    softening = -Saturating(2.8e8, 4e-7, -2.8e8).describing_function(knots).real
    baseline = BaselineParameters(nominal_parameters(STEEL), (LayerLaw(knots, knots, softening, 1e8 * knots / 1e-6),))
    omega = 2 * np.pi * np.linspace(154.0, 158.0, 9)
    force, response = np.ones((9, 1), complex), np.full((9, 2, 1), 60.0 + 0j)
    steps = build.steps(omega, force, response)
    hidden = steps.force_variance.copy()
    hidden[:, THIRD] = np.inf
    evidence = build.evidence(steel_model, replace(steps, force_variance=hidden), [])
    truth = ResidualModel(replace(evidence, rig=OTHER))
    balance = truth.step_receptance(baseline, inner=False)[2]
    R, _, at_omega = truth.at_harmonic(3, baseline, balance)
    p, ports = len(truth.points), truth.model.ports
    pushed = -balance_openings(baseline.laws, truth.openings(baseline, balance)).force[:, 0, :, None]
    at, held = truth.moving[:p], drive_stiffness(OTHER.drive, at_omega)
    at_drive = (R[:, [ports.drive]][:, :, at] @ pushed)[:, 0, 0]
    read = truth.measured_change(R[:, ports.outputs][:, :, at] @ pushed, at_omega)[:, evidence.reference, 0]
    ratio = np.zeros_like(steps.force)
    ratio[:, THIRD] = -held * at_drive / read
    return evidence, baseline, balance, ratio, R


def at_third(measured, error):
    """Receptances at the third harmonic, of the rig as its file says, with so large an error of the ratio."""
    evidence, baseline, balance, ratio, _ = measured
    std = np.full(ratio.shape, np.inf)
    std[:, THIRD] = error
    steps = replace(evidence.steps, force_ratio=ratio, force_ratio_std=std)
    return ResidualModel(replace(evidence, steps=steps)).at_harmonic(3, baseline, balance)[0]


def test_the_ratio_of_force_and_response_says_what_the_shaker_holds(measured):
    truth, far = measured[-1], at_third(measured, np.inf)
    error = np.max(np.abs(at_third(measured, 1e-3) - truth)) / np.max(np.abs(far - truth))
    assert error < 0.03


def test_a_ratio_that_is_all_noise_leaves_the_rig_file_s_shaker(measured):
    far = at_third(measured, np.inf)
    np.testing.assert_allclose(at_third(measured, 1e3), far, atol=1e-4 * np.max(np.abs(far)))
