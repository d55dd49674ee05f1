"""A sensor sits at another place than was written down."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, Parameter, Values, response_channels
from twin.identify.measured_data import output_place
from twin.identify.model_modification import ModelModification, point_mass


class SensorPosition(Cause):
    """Moves the place where one channel measures, and the sensor's mass.

    How much of the mass moved is fitted as well and not reported: a stud or the cable may have stayed, and the mass
    itself is assumed, not known.
    """

    name = "sensor-position"
    summary = "a sensor sits at another place than was written down"

    def labels(self, evidence: MeasuredData) -> Labels:
        """Any response channel whose sensor may have been moved."""
        reach = evidence.rig.layout().reach
        return [label for label in response_channels(evidence) if any(reach(output_place(evidence, label["channel"])))]

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Offset along its beam, and the share of the mass, which changes nothing by itself."""
        back, forth = evidence.rig.layout().reach(output_place(evidence, label["channel"]))
        return (
            Parameter(name="offset_m", scale=0.01, lower=-0.5 * back, upper=forth, null=0.0, starts=(-0.001,)),
            Parameter(name="carried", scale=0.5, lower=0.0, upper=1.0, null=1.0, starts=(0.0,)),
        )

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """The offset."""
        return {"offset_m": values["offset_m"]}, {name: std[name] for name in std if name == "offset_m"}

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the offset, with all of the sensor's mass moved."""
        return {**values, "carried": 1.0}

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The channel read elsewhere, and the inertia of its sensor taken from here to there."""
        here = output_place(evidence, label["channel"])
        there = evidence.rig.layout().moved(here, values["offset_m"])
        mass = values["carried"] * _mass(evidence, label)
        directions = len(evidence.model.structure.translations(here))
        carried = tuple(
            point_mass(place, own, directions=directions) for place, own in ((here, -mass), (there, mass)) if mass
        )
        return ModelModification(output_offset_m={label["channel"]: values["offset_m"]}, attachments=carried)


def _mass(evidence: MeasuredData, label: Label) -> float:
    return next((s.mass for s in evidence.rig.response_sensors if s.channel == label["channel"]), 0.0)
