"""The contact fades along the overlap: the bolt is off its place, or the faces are not parallel."""

from twin.causes.joints import JointCause
from twin.diagnose.cause import Label, MeasuredData, ModelModification, Parameter, Values


class JointUneven(JointCause):
    """Both moduli vary linearly along the overlap, 1 - gradient xi with xi from -1/2 to 1/2."""

    name = "joint-uneven"
    summary = "the joint is stiffer at one end of its layer than at the other"
    numbers = (
        # Two modes of a clean campaign by a program that shares no code with this one ask for a gradient of 0.05.
        Parameter(name="gradient", scale=0.7, lower=-1.95, upper=1.95, null=0.0, starts=(0.4,), tolerance=0.07),
    )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The structure with its strain operators weighted along the overlap."""
        return ModelModification(layer_gradient={self.joint(evidence, label): values["gradient"]})
