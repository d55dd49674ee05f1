"""Where a law is rough a step has several motions: that is taken which was measured."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.nonlinear.balance import Branch
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.residual_model import ResidualModel

pytestmark = pytest.mark.usefixtures("fundamentals_alone")

LATE, EARLY, NEVER = (7e-7, 8e-7), (2.6e-7, 3.2e-7), (7e-6, 8e-6)
"""Openings between which a joint gives way."""
LOST = 0.55


@pytest.fixture(scope="module")
def joints(baseline):
    """Of each a joint that loses more than half of E' there."""
    opening = np.geomspace(1e-8, 2e-5, 300)
    nothing = LayerLaw.zero(opening, opening)
    ramps = {where: np.interp(np.log(opening), np.log(where), (0, 1)) for where in (LATE, EARLY, NEVER)}
    E = baseline.base.E
    return {where: replace(baseline, laws=(replace(nothing, softening=E * LOST * s),)) for where, s in ramps.items()}


@pytest.fixture(scope="module")
def measured(evidence, joints):
    """What each joint does at the same motion of the reference channel, and its balance."""

    def of(where):
        residual_model, steps = ResidualModel(evidence), evidence.steps
        R, omega, found = residual_model.step_receptance(joints[where])
        H, force, response = residual_model.responses(R, omega), steps.force.copy(), steps.response.copy()
        force[:, 0] = response[:, 1, 0] / H[:, 1]
        response[:, :, 0] = H * force[:, :1]
        return replace(evidence, steps=replace(steps, force=force, response=response)), found

    return of


def missed(evidence, baseline):
    """Relative error of each step (s,)."""
    residual_model = ResidualModel(evidence)
    R, omega, _ = residual_model.step_receptance(baseline)
    return np.abs(residual_model.measured_over_predicted(R, omega) - 1).max(axis=1)


@pytest.fixture
def bistable(measured):
    """Steps at which the joint that gives way late may be whole as well as softened, but for its middle; what was
    measured of either; and a branch of softened motions."""
    (whole, stiff), (softened, soft) = measured(NEVER), measured(EARLY)
    outer, middle = [0, 2], 1
    stays = np.abs(stiff.motion[:, outer]).max(axis=1) < LATE[0]
    gone = np.abs(soft.motion[:, outer]).min(axis=1) > LATE[1]
    gone &= np.abs(soft.motion[:, middle]) < EARLY[0]
    return stays & gone, whole, softened, Branch(whole.steps.omega, whole.steps.amplitude_m, soft)


def test_the_softened_motions_are_found_on_their_branch_alone(joints, bistable):
    both, _, softened, branch = bistable
    joint = joints[LATE]
    assert np.count_nonzero(both) >= 3
    assert np.min(missed(softened, joint)[both]) > 0.02, "found from nothing, they are the whole joint's"
    assert np.max(missed(softened, replace(joint, branch=branch))[both]) < 1e-3


def test_the_whole_joints_motions_are_found_beside_a_branch_of_others(joints, bistable):
    both, whole, _, branch = bistable
    assert np.max(missed(whole, replace(joints[LATE], branch=branch))[both]) < 1e-3


def test_a_branch_of_other_steps_says_nothing(joints, bistable):
    _, _, softened, branch = bistable
    joint, elsewhere = joints[LATE], replace(branch, omega=1.001 * branch.omega)
    np.testing.assert_array_equal(missed(softened, replace(joint, branch=elsewhere)), missed(softened, joint))
