"""A crack or a damaged section: a short length of beam bends more easily."""

import numpy as np

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values
from twin.diagnose.places import beam_labels, place_at, position
from twin.identify.model_modification import Attachment, ModelModification
from twin.structure.weakened import weakened_section


class StiffnessLoss(Cause):
    """Takes a part of the stiffness off one element's length of beam."""

    name = "stiffness-loss"
    summary = "a short section of a beam is weaker in bending, as a crack makes it"
    labels = staticmethod(beam_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """What is left of the section's stiffness, and where it is."""
        return (
            Parameter(name="factor", scale=0.4, lower=0.02, upper=1.0, null=1.0, starts=(0.8,)),
            *position(evidence, label, 17),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """What an element that the section covers, wholly or in part, has less than a sound one."""
        place, factor = place_at(evidence, label, values), values["factor"]
        section = weakened_section(evidence.rig, evidence.model.structure, place=place, factor=factor)
        lost = Attachment(section.rows, lambda omega: np.tile(section.lost, (len(omega), 1)), beam=place.part)
        return ModelModification(attachments=(lost,))
