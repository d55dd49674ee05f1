"""The joint opens on one side of its motion: the layer loses stiffness beyond a gap (micro-slap)."""

import numpy as np

from twin.causes.joints import JointCause
from twin.diagnose.cause import Label, MeasuredData, Parameter, Values, thresholds
from twin.identify.joint_motion import largest_motion
from twin.identify.model_modification import ModelModification, Opening


class JointSlap(JointCause):
    """Where the opening exceeds the gap, the layer's normal stiffness is multiplied by a factor.

    Opening and closing differ, so the joint's force has even harmonics, which no law that is odd in the strain has.
    """

    name = "joint-slap"
    summary = "the joint opens on one side of its motion and claps shut"

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """What is left of the stiffness, and the opening at which it goes."""
        # Of any of the joint's points, where the rig moves as far as was measured and its joints are linear, m.
        largest = float(np.max(largest_motion(evidence, self.number(evidence, label))[0]))
        starts = thresholds(largest, least=0.01)
        return (
            Parameter(name="stiffness_factor", scale=0.5, lower=0.0, upper=4.0, null=1.0, starts=(0.9,)),
            Parameter(name="gap_m", scale=largest, lower=0.0, upper=3 * largest, starts=starts),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """One-sided contact at every point of the layer."""
        return ModelModification(
            opening={self.joint(evidence, label): Opening(values["gap_m"], values["stiffness_factor"])}
        )
