"""Where shakers drive and channels measure, as far as the rig file's effects know it."""

from twin.identify.measured_data import MeasuredData
from twin.rigs import Place


def drive_places(evidence: MeasuredData) -> tuple[Place, ...]:
    """Where each of the rig's drives is known to act."""
    off, layout = evidence.known.drive_offset_m, evidence.rig.layout()
    return tuple(layout.moved(place, off.get(name, 0.0)) for name, place in evidence.rig.drives.items())


def output_place(evidence: MeasuredData, channel: str) -> Place:
    """Where a response channel is known to measure."""
    nominal = next(output.place for output in evidence.outputs if output.channel == channel)
    return evidence.rig.layout().moved(nominal, evidence.known.output_offset_m.get(channel, 0.0))
