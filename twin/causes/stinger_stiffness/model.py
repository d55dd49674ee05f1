"""The stinger holds the structure at the drive point, and the force cell does not see it."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values, shaker_labels
from twin.diagnose.places import brought_along
from twin.identify.model_modification import ModelModification


class StingerStiffness(Cause):
    """A spring to ground at the drive point, on the beam's side of the cell."""

    name = "stinger-stiffness"
    summary = "the stinger's side stiffness holds the structure at the drive point"
    labels = staticmethod(shaker_labels)
    numbers = (Parameter(name="stiffness_N_per_m", scale=2e4, lower=0.0, upper=1e7, null=0.0, starts=(2000.0,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A constant stiffness at the drive point."""
        k = values["stiffness_N_per_m"]
        return ModelModification(attachments=brought_along(evidence, lambda omega: np.full((len(omega), 1), k + 0j)))
