"""The shaker drives the beam at another place than was written down."""

from twin.diagnose.cause import Cause, Label, Labels, MeasuredData, ModelModification, Parameter, Values
from twin.identify.measured_data import drive_places


class DrivePosition(Cause):
    """Moves a drive point along the beam."""

    name = "drive-position"
    summary = "the shaker sits at another place than was written down"

    def labels(self, evidence: MeasuredData) -> Labels:
        """The force channels whose shaker may have been moved."""
        reach = evidence.rig.layout().reach
        cells = evidence.rig.force_cells
        movable = [
            name for name, place in zip(evidence.rig.drives, drive_places(evidence), strict=True) if any(reach(place))
        ]
        return tuple({"channel": cells[name]} for name in movable)

    def parameters(self, evidence: MeasuredData, label: Label) -> tuple[Parameter, ...]:
        """Offset along its beam."""
        number = [*evidence.rig.drives].index(_drive(evidence, label))
        back, forth = evidence.rig.layout().reach(drive_places(evidence)[number])
        return (
            Parameter(name="offset_m", scale=0.01, lower=-0.8 * back, upper=0.9 * forth, null=0.0, starts=(0.001,)),
        )

    def modification(self, evidence: MeasuredData, label: Label, values: Values) -> ModelModification:
        """The same structure, driven elsewhere."""
        return ModelModification(drive_offset_m={_drive(evidence, label): values["offset_m"]})


def _drive(evidence: MeasuredData, label: Label) -> str:
    """Name of the drive whose force cell it is."""
    return next(name for name, cell in evidence.rig.force_cells.items() if cell == label["channel"])
