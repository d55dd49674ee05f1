"""A mass between force cell and beam: a stud, wax, the cell's own live side."""

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values, shaker_labels
from twin.diagnose.places import brought_along
from twin.identify.model_modification import ModelModification


class DriveMass(Cause):
    """The force that reaches the beam is the measured one less what accelerates this mass."""

    name = "drive-mass"
    summary = "a mass sits between the force cell and the structure"
    labels = staticmethod(shaker_labels)
    numbers = (Parameter(name="mass_kg", scale=0.03, lower=-0.05, upper=0.5, null=0.0, starts=(0.005,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A mass at the drive point, across the beam only."""
        mass = values["mass_kg"]
        return ModelModification(attachments=brought_along(evidence, lambda omega: -mass * omega[:, None] ** 2 + 0j))
