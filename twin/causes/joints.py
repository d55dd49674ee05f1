"""What causes in a joint have in common: each is searched in every joint of the rig."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData


class JointCause(Cause):
    """Something in one joint; the label names it in a rig of several."""

    def labels(self, evidence: MeasuredData) -> Labels:
        """Which joint: a single search where there is one, without a name."""
        joints = evidence.joints
        return ({},) if len(joints) == 1 else tuple({"joint": joint.name} for joint in joints)

    def joint(self, evidence: MeasuredData, label: Label) -> str:
        """The joint that a label names, or the only one."""
        return label.get("joint") or evidence.joints[0].name

    def number(self, evidence: MeasuredData, label: Label) -> int:
        """Of that joint, in the rig's order."""
        return [joint.name for joint in evidence.joints].index(self.joint(evidence, label))
