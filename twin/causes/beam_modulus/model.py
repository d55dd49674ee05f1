"""Young's modulus of one beam is not what the data sheet says."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values

DATA_SHEET, IDENTIFIED = 0.05, 0.005
"""Usual error of a modulus: of a data sheet's, and of one that was updated to the structure's own modes."""


class BeamModulus(Cause):
    """Scales the bending and axial stiffness of one beam."""

    name = "beam-modulus"
    summary = "a beam is softer or stiffer than its material data say"

    def labels(self, evidence: MeasuredData) -> Labels:
        """Any beam."""
        return tuple({"beam": beam.name} for beam in evidence.rig.layout().beams)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """A factor; what was identified on the structure itself is known better than a data sheet's."""
        scale = IDENTIFIED if evidence.rig.natural_frequencies.offset else DATA_SHEET
        return (Parameter(name="factor", scale=scale, lower=0.3, upper=3.0, null=1.0, starts=(0.98,)),)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The structure with the beam's modulus scaled."""
        return ModelModification(beam_modulus={label["beam"]: values["factor"]})
