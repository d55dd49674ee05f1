"""Something that rubs viscously against the surroundings: a cable in a tight guide, grease, a foam rest."""

from twin.diagnose.cause import Cause, Label, MeasuredData, Parameter, Values
from twin.diagnose.places import place_at, place_labels, point, position
from twin.identify.model_modification import Attachment, ModelModification


class ViscousDamper(Cause):
    """A dashpot to ground."""

    name = "viscous-damper"
    summary = "a dashpot acts between the structure and its surroundings"
    labels = staticmethod(place_labels)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Damping constant and place."""
        return (
            Parameter(name="damping_Ns_per_m", scale=1.0, lower=0.0, upper=100.0, null=0.0, starts=(0.1,)),
            *position(evidence, label),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """J omega c at the place."""
        c = values["damping_Ns_per_m"]
        at = point(place_at(evidence, label, values))
        return ModelModification(attachments=(Attachment(at, lambda omega: 1j * c * omega[:, None]),))
