"""Which of the rig's sensors a measured response belongs to: by name, by place and direction, or as the only one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from recordings.directions import cosine
from recordings.errors import InputError
from recordings.responses import End, FoundResponse, Responses
from twin.identify.responses.limits import LIMITS
from twin.rigs import BeamPart, Place, Rig
from twin.rigs.matrices.found import ORDER_LIMIT
from twin.rigs.node_tables import read_node_table

Vector = tuple[float, float, float]


@dataclass(frozen=True)
class Matched:
    """A response of the rig's channel."""

    channel: str
    sign: float
    """-1 where it was measured against the rig's directions."""
    found: FoundResponse


def match_responses(file: Responses, rig: Rig) -> tuple[tuple[Matched, ...], tuple[str, ...]]:
    """The responses of a file that the rig's drive and sensors have; and a line on each that they have not.

    What was measured with hammer and sensor the other way round is the same response, by reciprocity.

    InputError if none is.
    """
    ends = _Ends.of(file, rig)
    alone = len(file.responses) == 1 and len(rig.response_sensors) == 1
    found, told = [], []
    for one in file.responses:
        for response, reference in ((one.response, one.reference), (one.reference, one.response)):
            drive, channel = ends.drive(reference), ends.sensor(response)
            if drive and channel:
                found.append(Matched(channel[0], channel[1] * drive, one))
                break
        else:
            if alone:
                return (Matched(rig.response_sensors[0].channel, 1.0, one),), (
                    f"{one.place} is taken for {rig.response_sensors[0].channel}: both are alone",
                )
            told.append(f"{one.place}: {one.response.told or 'a response'} over {one.reference.told or 'a force'}")
    if not found:
        sensors = ", ".join(sensor.channel for sensor in rig.response_sensors)
        raise InputError(
            file.path, "", f"none of its responses is one of the rig's ({'; '.join(told)[:200]})",
            f"name them as the rig's channels, {sensors} over {rig.force_sensor.channel}, or give nodes their places",
        )  # fmt: skip
    return tuple(found), tuple(f"{line} is none of the rig's channels and was not used" for line in told)


@dataclass(frozen=True)
class _Ends:
    """Places of the rig's drive and sensors, and of the file's nodes."""

    force: str
    drive_at: Place
    sensors: Mapping[str, Place]
    points: Mapping[str, Vector]
    nodes: Mapping[int, Vector]
    near_m: float

    @classmethod
    def of(cls, file: Responses, rig: Rig) -> _Ends:
        sensors = {sensor.channel: rig.place_of(sensor.channel) for sensor in rig.response_sensors}
        places = {rig.force_sensor.channel: rig.drive_place, **sensors}
        points = dict(zip(places, _points(rig, list(places.values())), strict=True)) if file.nodes else {}
        known = np.array([*file.nodes.values()]) if file.nodes else np.zeros((1, 3))
        size = float(np.max(np.ptp(known, axis=0)))
        return cls(rig.force_sensor.channel, rig.drive_place, sensors, points, file.nodes, LIMITS.near * size)

    def drive(self, end: End) -> float:
        """Sign of an end that is where the rig is driven, as one is of which the file says nothing; 0 if not there."""
        if end == End():
            return 1.0
        if end.name == self.force:
            return _sign(end, self.drive_at) or 1.0
        return _sign(end, self.drive_at) if self._here(end, self.force, self.drive_at) else 0.0

    def sensor(self, end: End) -> tuple[str, float] | None:
        """Channel and sign of an end that is one of the rig's sensors."""
        for channel, place in self.sensors.items():
            if end.name == channel:
                return channel, _sign(end, place) or 1.0
        for channel, place in self.sensors.items():
            if self._here(end, channel, place) and (sign := _sign(end, place)):
                return channel, sign
        return None

    def _here(self, end: End, channel: str, place: Place) -> bool:
        if end.node and end.node in self.nodes and channel in self.points:
            return bool(np.linalg.norm(np.subtract(self.nodes[end.node], self.points[channel])) <= self.near_m)
        return bool(end.node) and not self.nodes and float(end.node) == place.at


def _sign(end: End, place: Place) -> float:
    """1 along the place's direction, -1 against it, 0 across."""
    if not end.direction:
        return 1.0
    along = cosine(end.direction, place.direction)
    return float(np.sign(along)) if abs(along) >= LIMITS.matching_along else 0.0


def _points(rig: Rig, places: Sequence[Place]) -> list[Vector]:
    """Coordinates of places, m."""
    layout, found = rig.layout(), []
    for place in places:
        part = layout.part(place.part)
        if isinstance(part, BeamPart):
            start, end = (np.array([*point, 0.0][:3]) for point in (part.start, part.end))
            at = start + (end - start) * place.at / part.length
        else:
            table = read_node_table(layout.file(part.nodes, "nodes"), order=ORDER_LIMIT)
            at = table.coordinates[int(np.argmin(np.abs(table.nodes - place.at)))]
        found.append((float(at[0]), float(at[1]), float(at[2])))
    return found
