"""The shaker drives the beam at another place than was written down."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values


class DrivePosition(Cause):
    """Moves the drive point along the beam."""

    name = "drive-position"
    summary = "the shaker sits at another place than was written down"

    def labels(self, evidence: MeasuredData) -> Labels:
        """The force channel, if its shaker may have been moved."""
        return ({"channel": evidence.force},) if any(evidence.rig.layout().reach(evidence.drive_place)) else ()

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Offset along its beam."""
        back, forth = evidence.rig.layout().reach(evidence.drive_place)
        return (
            Parameter(
                name="offset_m",
                scale=0.01,
                lower=-0.8 * back,
                upper=0.9 * forth,
                null=0.0,
                starts=(0.001,),
            ),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The same structure, driven elsewhere."""
        return ModelModification(drive_offset_m=values["offset_m"])
