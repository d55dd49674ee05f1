"""The clamp turns under the beam's root moment."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values


class ClampCompliance(Cause):
    """A rotational spring between the clamp and the beam's root."""

    name = "clamp-compliance"
    summary = "the clamp is not rigid: the beam's root turns under its moment"

    def labels(self, evidence: MeasuredData) -> Labels:
        """Each beam whose rotation is held; a single one needs no name."""
        held = _held_beams(evidence)
        return ({},) * len(held) if len(held) < 2 else tuple({"support": name} for name in held)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Rotation per moment; one element's own flexibility is the natural unit."""
        beam = evidence.rig.layout().beam(_support(evidence, label))
        unit = beam.length / (beam.youngs_modulus * beam.second_moment)
        return (
            Parameter(
                name="rotational_rad_per_Nm", scale=0.02 * unit, lower=1e-6 * unit, upper=unit, null=1e-6 * unit,
                starts=(0.005 * unit,),
            ),
        )  # fmt: skip

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The structure with its root free to turn against a spring."""
        return ModelModification(clamp_rad_per_Nm={_support(evidence, label): values["rotational_rad_per_Nm"]})


def _held_beams(evidence: MeasuredData) -> list[str]:
    """Names of the beams that a support keeps from turning."""
    layout = evidence.rig.layout()
    beams = {beam.name for beam in layout.beams}
    return list(dict.fromkeys(s.part for s in layout.supports if s.holds_rotation and s.part in beams))


def _support(evidence: MeasuredData, label: Label) -> str:
    return label.get("support") or _held_beams(evidence)[0]
