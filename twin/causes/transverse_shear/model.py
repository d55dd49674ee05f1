"""A beam so thick or so soft in shear that Euler and Bernoulli do not hold."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values


class TransverseShear(Cause):
    """Timoshenko elements, with rotary inertia, for one beam."""

    name = "transverse-shear"
    summary = "a beam shears: its higher modes lie lower than bending alone would have them"
    numbers = (Parameter(name="modulus_ratio", scale=30.0, lower=1e-3, upper=500.0, null=1e-3, starts=(10.0,)),)

    def labels(self, evidence: MeasuredData) -> Labels:
        """Any beam."""
        return tuple({"beam": beam.name} for beam in evidence.rig.layout().beams)

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The structure with one beam of Timoshenko elements."""
        return ModelModification(beam_shear_ratio={label["beam"]: values["modulus_ratio"]})
