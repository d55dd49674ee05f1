"""Young's modulus of one beam is not what the data sheet says."""

from collections.abc import Mapping, Sequence

from twin.diagnose.cause import Cause, Parameter, Values
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification

DATA_SHEET, IDENTIFIED = 0.05, 0.005
"""Usual error of a modulus: of a data sheet's, and of one that was updated to the structure's own modes."""


class BeamModulus(Cause):
    """Scales the bending and axial stiffness of one beam."""

    name = "beam-modulus"
    summary = "a beam is softer or stiffer than its material data say"

    def labels(self, evidence: MeasuredData) -> Sequence[Mapping[str, str]]:
        """Any beam."""
        return tuple({"beam": beam.name} for beam in evidence.rig.layout().beams)

    def parameters(self, evidence: MeasuredData, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """A factor; what was identified on the structure itself is known better than a data sheet's."""
        scale = IDENTIFIED if evidence.rig.natural_frequencies.offset else DATA_SHEET
        return (Parameter(name="factor", scale=scale, lower=0.3, upper=3.0, null=1.0, starts=(0.98,)),)

    def modification(self, evidence: MeasuredData, label: Mapping[str, str], values: Values) -> ModelModification:
        """The structure with the beam's modulus scaled."""
        return ModelModification(beam_modulus={label["beam"]: values["factor"]})
