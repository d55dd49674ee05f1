"""Rig files of format 1: two beams that overlap, one clamp, one thin layer; short for a layout of format 2.

The lower beam is clamped at x = 0 and the upper one reaches the tip.  A position is metres from the clamp; within the
overlap it is the lower beam's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from recordings.numbers import Length, NonNegative
from recordings.toml_input import Table
from twin.rigs.beam_part import BeamPart, BeamSection
from twin.rigs.layout import Layout, Place, Stretch, Support, ThinLayer
from twin.rigs.limits import LIMITS
from twin.rigs.rig import Rig
from twin.rigs.tables import AnyLaw, Preload, Shaker, Transducer, check_law

BENCH_BEAM_ELEMENTS, BENCH_LAYER_ELEMENTS = 60, 6


class Beam(BeamSection):
    """A uniform rectangular beam."""

    length: Length


class Joint(Table):
    """The overlap and its thin layer, whose height is measured from neutral axis to neutral axis."""

    overlap: Length
    layer_height: Length
    layer_elements: Annotated[int, Field(ge=1, le=50)] = 3
    preload: dict[str, Preload] = Field(min_length=1)
    law: AnyLaw | None = None

    @model_validator(mode="after")
    def _passive(self) -> Joint:
        check_law(self.law, self.preload)
        return self


class Mesh(Table):
    """Number of beam elements of the two beams together."""

    beam_elements: Annotated[int, Field(ge=4, le=LIMITS.most_elements)] = 41


class Drive(Shaker):
    """The shaker, and where it drives the structure."""

    position: NonNegative


class Sensor(Transducer):
    """A transducer, and where it is."""

    position: NonNegative


class LapJointRig(Rig):
    """A cantilever of two beams with one lap joint."""

    format: Literal[1] = 1
    lower: Beam
    upper: Beam
    joint: Joint
    mesh: Mesh = Mesh()
    drive: Drive
    sensor: list[Sensor] = Field(min_length=1, max_length=LIMITS.most_sensors)

    @model_validator(mode="after")
    def _geometry(self) -> LapJointRig:
        if self.joint.overlap >= min(self.lower.length, self.upper.length):
            raise ValueError(
                f"joint.overlap {self.joint.overlap} must be shorter than both beams "
                f"(lower.length {self.lower.length}, upper.length {self.upper.length})"
            )
        if self.mesh.beam_elements < 2 * self.joint.layer_elements + 2:
            raise ValueError(
                f"mesh.beam_elements {self.mesh.beam_elements} leaves no element outside the overlap; "
                f"at least {2 * self.joint.layer_elements + 2} are needed"
            )
        places = [("drive.position", self.drive.position)]
        places += [(f"sensor {s.channel!r}: position", s.position) for s in self.sensor]
        for place, position in places:
            if position > self.length + 1e-9:
                raise ValueError(f"{place} {position} lies beyond the structure's end at {self.length:.4g} m")
        return self

    @property
    def length(self) -> float:
        """From the clamp to the tip, m."""
        return self.lower.length + self.upper.length - self.joint.overlap

    def layout(self, *, beam_elements: int | None = None, layer_elements: int | None = None) -> Layout:
        """Two beams, a clamp and a layer; elements as the file says, or others of both beams together."""
        layer = layer_elements or self.joint.layer_elements
        outside = (beam_elements or self.mesh.beam_elements) - 2 * layer
        below, above = self.lower.length - self.joint.overlap, self.upper.length - self.joint.overlap
        of_lower = min(max(1, int(outside * below / (below + above))), outside - 1)
        height = self.joint.layer_height
        beams = (
            ("lower", self.lower, (0.0, 0.0), (self.lower.length, 0.0), of_lower),
            ("upper", self.upper, (below, height), (self.length, height), outside - of_lower),
        )
        parts = tuple(
            BeamPart.model_construct(
                name=name, kind="beam", start=start, end=end, elements=elements + layer,
                **beam.model_dump(exclude={"length"}),
            )
            for name, beam, start, end, elements in beams
        )  # fmt: skip
        joint = ThinLayer.model_construct(
            name="joint", kind="thin-layer", between=("lower", "upper"), begin=below, to=self.lower.length,
            layer_height=height, width=min(self.lower.width, self.upper.width), layer_elements=layer,
            preload=self.joint.preload, law=self.joint.law,
        )  # fmt: skip
        clamp = Support.model_construct(part="lower", at=0.0, fix=["x", "y", "rz"])
        stretches = (Stretch("lower", 0.0, self.lower.length), Stretch("upper", self.joint.overlap, self.upper.length))
        return Layout(parts, (clamp,), (joint,), (), stretches, passable=True)

    def bench_layout(self) -> Layout:
        """The same with more elements."""
        return self.layout(beam_elements=BENCH_BEAM_ELEMENTS, layer_elements=BENCH_LAYER_ELEMENTS)

    @property
    def shaker(self) -> Drive:
        """The one that drives."""
        return self.drive

    @property
    def drive_place(self) -> Place:
        """Across the beam."""
        return self.layout().place(self.drive.position)

    def place_of(self, channel: str) -> Place:
        """Where a sensor is; all measure across the beam."""
        for sensor in self.sensor:
            if sensor.channel == channel:
                place = self.layout().place(sensor.position)
                return replace(place, reads=sensor.reads or place.reads)
        raise KeyError(channel)

    @property
    def sentence(self) -> str:
        """What it is made of and what holds it, in words."""
        return f"two beams with an overlap of {1e3 * self.joint.overlap:g} mm, clamped at one end"

    def with_joints(self, joints: Sequence[ThinLayer]) -> Self:
        """The same rig with this joint's preloads and law."""
        (joint,) = joints
        own = self.joint.model_copy(update={"preload": joint.preload, "law": joint.law})
        return self.model_copy(update={"joint": own})

    def hit_at(self, place: Place) -> Self:
        """The same rig hit there by a hammer."""
        position = self.layout().position(place) if place.part in ("lower", "upper") else None
        if position is None or position > self.length:
            raise ValueError(f"point: there is no place {place.at:g} on {place.part!r}; it has lower and upper")
        here = {"position": position, "mass": 0.0, "stinger_side_mass": 0.0}
        sensors = [self.force_sensor.model_copy(update=here), *self.response_sensors]
        return self.model_copy(update={"sensor": sensors, "drive": Drive(position=position)})

    def with_moved_sensor(self, channel: str, place: Place) -> Self:
        """The same rig with a sensor elsewhere."""
        position = self.layout().position(place)
        sensors = [s.model_copy(update={"position": position}) if s.channel == channel else s for s in self.sensor]
        return self.model_copy(update={"sensor": sensors})
