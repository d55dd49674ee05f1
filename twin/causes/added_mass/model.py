"""A mass nobody told the model of, a cable clamp, a magnet left on; or a listed one that is lighter or gone."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, Parameter, Values
from twin.diagnose.places import part_labels, place_at, position
from twin.identify.model_modification import ModelModification, point_mass
from twin.rigs import BeamPart, Place, PointMass, Rig

UNLISTED = 0.05
"""Mass, kg, that a model without lumps may have too much."""


class AddedMass(Cause):
    """Adds -omega^2 m at a place, along and across the beam; each of the rig file's lumps is a place of it, too."""

    name = "added-mass"
    summary = "a mass sits on the structure that the model does not have"

    def labels(self, evidence: MeasuredData) -> Labels:
        """Anywhere on a part, or one of the listed masses."""
        listed = ({"part": mass.part, "mass": name} for name, mass in _listed(evidence.rig).items())
        return (*part_labels(evidence), *listed)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Mass and where it sits; of a listed one up to all that it has, at its place."""
        if "mass" not in label:
            mass = Parameter(
                name="mass_kg", scale=0.02, lower=-_missing(evidence.rig), upper=0.5, null=0.0, starts=(0.004,),
            )  # fmt: skip
            return (mass, *position(evidence, label))
        listed = _listed(evidence.rig)[label["mass"]]
        whole, beam = listed.mass, isinstance(evidence.rig.layout().part(listed.part), BeamPart)
        return (
            Parameter(
                name="mass_kg", scale=whole, lower=-whole, upper=whole, null=0.0, starts=(-0.3 * whole,),
            ),
            Parameter(
                name="position_m" if beam else "node", scale=1.0, lower=listed.at, upper=listed.at, starts=(listed.at,)
            ),
        )  # fmt: skip

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """A point mass."""
        if "mass" in label:
            listed = _listed(evidence.rig)[label["mass"]]
            place = Place(listed.part, listed.at, (0.0, 1.0, 0.0))
        else:
            place = place_at(evidence, label, values)
        directions = len(evidence.model.structure.translations(place))
        return ModelModification(attachments=(point_mass(place, values["mass_kg"], directions=directions),))


def _missing(rig: Rig) -> float:
    """What may be missing anywhere, kg: where the rig file lists its lumps, no more than a sensor weighs."""
    return max(sensor.mass for sensor in rig.sensor) if rig.layout().masses else UNLISTED


def _listed(rig: Rig) -> dict[str, PointMass]:
    """The rig file's lumps by name."""
    return {mass.name or f"{mass.part} at {mass.at:g}": mass for mass in rig.layout().masses if mass.mass > 0}
