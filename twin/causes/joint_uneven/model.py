"""The contact fades along the overlap: the bolt is off its place, or the faces are not parallel."""

from twin.diagnose.cause import (
    Cause,
    Label,
    MeasuredData,
    ModelModification,
    Parameter,
    Values,
    joint_labels,
    joint_name,
)


class JointUneven(Cause):
    """Both moduli vary linearly along the overlap, 1 - gradient xi with xi from -1/2 to 1/2."""

    name = "joint-uneven"
    summary = "the joint is stiffer at one end of its layer than at the other"
    labels = staticmethod(joint_labels)
    numbers = (
        # Two modes of a clean campaign by a program that shares no code with this one ask for a gradient of 0.05.
        Parameter(name="gradient", scale=0.7, lower=-1.95, upper=1.95, null=0.0, starts=(0.4,), tolerance=0.07),
    )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The structure with its strain operators weighted along the overlap."""
        return ModelModification(layer_gradient={joint_name(evidence, label): values["gradient"]})
