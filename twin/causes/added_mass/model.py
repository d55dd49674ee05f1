"""A mass nobody told the model of: a cable clamp, a heavier sensor, a magnet left on."""

from collections.abc import Mapping

from twin.diagnose.cause import Cause, Parameter, Values
from twin.diagnose.places import part_labels, place_at, position
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification, point_mass


class AddedMass(Cause):
    """Adds -omega^2 m at a place, along and across the beam."""

    name = "added-mass"
    summary = "a mass sits on the structure that the model does not have"
    labels = staticmethod(part_labels)

    def parameters(self, evidence: MeasuredData, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """Mass and where it sits."""
        return (
            Parameter(name="mass_kg", scale=0.02, lower=-0.05, upper=0.5, null=0.0, starts=(0.004,), model_error=0.002),
            *position(evidence, label),
        )

    def modification(self, evidence: MeasuredData, label: Mapping[str, str], values: Values) -> ModelModification:
        """A point mass."""
        place, mass = place_at(evidence, label, values), values["mass_kg"]
        return ModelModification(
            attachments=(point_mass(place, mass, directions=len(evidence.model.structure.translations(place))),)
        )
