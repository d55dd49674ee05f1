"""How far the layer's points moved in the measured steps, before anything is known of the joint's law."""

import numpy as np

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals.residual_model import ResidualModel


def largest_motion(evidence: MeasuredData, joint: int) -> tuple[Array, Array]:
    """Largest opening and slip (p,) of each of a joint's points over all steps, m, were the joints linear."""
    residual_model = ResidualModel(evidence)
    base = evidence.linear.base if evidence.linear else nominal_parameters(evidence.rig, evidence.preload)
    p, own = len(residual_model.points), residual_model.local.of_joint(joint)
    if not len(evidence.steps):
        return np.full(len(own), LIMITS.unknown_m), np.full(len(own), LIMITS.unknown_m)
    nothing = np.array([LIMITS.unknown_m, 2 * LIMITS.unknown_m])
    linear = BaselineParameters(base, (LayerLaw.zero(nothing, nothing),) * base.joints)
    motion = np.abs(residual_model.step_receptance(linear, inner=False)[2].motion)
    return motion[:, own].max(axis=0), motion[:, p + own].max(axis=0)
