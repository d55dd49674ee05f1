"""Rig files of format 2: any parts, supports, joints and ties; shakers and sensors at any place, in any direction."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeVar

import numpy as np
from pydantic import Field, PrivateAttr, field_validator, model_validator

from recordings.directions import Towards, unit_vector
from recordings.toml_input import Name, Table
from twin.rigs.layout import (
    At,
    BeamPart,
    Damper,
    Dof,
    Layout,
    Link,
    MatricesPart,
    Part,
    Place,
    PointMass,
    Spring,
    Stretch,
    Support,
    ThinLayer,
    Tie,
)
from twin.rigs.limits import LIMITS
from twin.rigs.rig import Rig, unique
from twin.rigs.tables import Shaker, Transducer

Meshed = TypeVar("Meshed", BeamPart, ThinLayer)


class _Placed(Table):
    """Something fixed to a part."""

    part: Name
    at: At
    direction: Towards = "+y"

    @property
    def place(self) -> Place:
        """Where, and in which direction."""
        return Place(self.part, self.at, unit_vector(self.direction))


class PlacedDrive(_Placed, Shaker):
    """A shaker, and where and in which direction it drives."""

    name: Name = "drive"


class PlacedSensor(_Placed, Transducer):
    """A transducer, and where and in which direction it measures."""


class StructureRig(Rig):
    """A rig of any structure."""

    format: Literal[2]
    part: list[Annotated[Part, Field(discriminator="kind")]] = Field(min_length=1, max_length=100)
    support: list[Support] = Field(default=[], max_length=100)
    joint: list[ThinLayer] = Field(default=[], max_length=50)
    tie: list[Tie] = Field(default=[], max_length=100)
    mass: list[PointMass] = Field(default=[], max_length=100)
    spring: list[Spring] = Field(default=[], max_length=100)
    damper: list[Damper] = Field(default=[], max_length=100)
    drive: list[PlacedDrive] = Field(min_length=1, max_length=16)
    sensor: list[PlacedSensor] = Field(min_length=1, max_length=LIMITS.most_sensors)
    _folder: Path | None = PrivateAttr(default=None)

    @field_validator("drive", mode="before", json_schema_input_type=PlacedDrive | list[PlacedDrive])
    @classmethod
    def _one_or_more(cls, value: Any) -> Any:
        return value if isinstance(value, list) else [value]

    @model_validator(mode="after")
    def _consistent(self) -> StructureRig:
        unique("part names", [part.name for part in self.part])
        unique("joint names", [joint.name for joint in self.joint])
        if len(self.drive) > 1:
            unique("drive names", [drive.name for drive in self.drive])
        if len({part.in_space for part in self.part if isinstance(part, BeamPart)}) > 1:
            raise ValueError("part: plane beams and beams in space cannot be mixed; give all beams three coordinates")
        for number, support in enumerate(self.support):
            self._check_place(f"support.{number}", support.part, support.at)
        for joint in self.joint:
            self._check_joint(joint)
        for number, tie in enumerate(self.tie):
            self._check_tie(f"tie.{number}", tie)
        for number, mass in enumerate(self.mass):
            self._check_place(f"mass.{number}", mass.part, mass.at)
            self._check_moves(f"mass.{number}", mass.part, list(mass.inertia))
        links: list[tuple[str, Link, dict[Dof, float]]] = [
            (f"spring.{n}", spring, spring.stiffness) for n, spring in enumerate(self.spring)
        ]
        links += [(f"damper.{n}", damper, damper.damping) for n, damper in enumerate(self.damper)]
        for where, link, acts in links:
            for name, at in zip(link.between, link.at, strict=True):
                self._check_place(where, name, at)
                self._check_moves(where, name, list(acts))
        for drive in self.drive:
            self._check_place(f"drive {drive.name!r}", drive.part, drive.at)
            self._check_plane(f"drive {drive.name!r}", drive.place)
        for sensor in self.sensor:
            self._check_place(f"sensor {sensor.channel!r}", sensor.part, sensor.at)
            self._check_plane(f"sensor {sensor.channel!r}", sensor.place)
            if sensor.reads == "strain":
                self._check_surface(f"sensor {sensor.channel!r}", sensor.place)
        self._check_force_cell()
        for joint in self.joint[1:]:
            first = self.joint[0]
            if set(joint.preload) != set(first.preload):
                raise ValueError(
                    f"joint {joint.name!r}: all joints must have the same preloads; it has {', '.join(joint.preload)}, "
                    f"joint {first.name!r} has {', '.join(first.preload)}"
                )
        return self

    def _find(self, where: str, name: str) -> Part:
        for part in self.part:
            if part.name == name:
                return part
        raise ValueError(f"{where}: no part {name!r}; there are {', '.join(part.name for part in self.part)}")

    def _check_place(self, where: str, name: str, at: float) -> None:
        part = self._find(where, name)
        if isinstance(part, BeamPart) and at > part.length + LIMITS.structure_rig_beyond_m:
            raise ValueError(f"{where}: at {at:g} lies beyond the end of {name!r} at {part.length:.6g} m")
        if isinstance(part, MatricesPart) and at != int(at):
            raise ValueError(f"{where}: at {at:g} is no node number of {name!r}")

    def _check_moves(self, where: str, name: str, dofs: Sequence[str]) -> None:
        part = self._find(where, name)
        if isinstance(part, BeamPart) and not part.in_space and (lost := set(dofs) - {"x", "y", "rz"}):
            raise ValueError(f"{where}: {name!r} is a plane beam and moves along x and y and about z, not {min(lost)}")

    def _check_plane(self, where: str, place: Place) -> None:
        part = self._find(where, place.part)
        if isinstance(part, BeamPart) and not part.in_space and abs(place.direction[2]) > 1e-9:
            raise ValueError(f"{where}: a plane beam does not move along z; give its start and end three coordinates")

    def _check_surface(self, where: str, place: Place) -> None:
        part = self._find(where, place.part)
        if not isinstance(part, BeamPart):
            raise ValueError(f"{where}: strain is read at the surface of a beam, and {part.name!r} is none")
        across = sum(x * n for x, n in zip(place.direction, part.normal, strict=True))
        if abs(across) < LIMITS.structure_rig_facing:
            raise ValueError(f"{where}: its direction must be across {part.name!r}: that of the surface it is on")

    def _check_joint(self, joint: ThinLayer) -> None:
        where = f"joint {joint.name!r}"
        first, second = (self._find(where, name) for name in joint.between)
        if joint.begin is None or joint.to is None:
            if isinstance(first, BeamPart) or isinstance(second, BeamPart):
                raise ValueError(f"{where}: pairs are of parts given by matrices; a beam's layer lies from .. to ..")
            return
        if not (isinstance(first, BeamPart) and isinstance(second, BeamPart)):
            raise ValueError(f"{where}: from .. to .. lies along beams; parts given by matrices need pairs")
        if joint.to > first.length + LIMITS.structure_rig_beyond_m:
            raise ValueError(f"{where}: to {joint.to:g} lies beyond the end of {first.name!r} at {first.length:.6g} m")
        self._check_beside(where, first, second)
        for s in (joint.begin, joint.to):
            facing = first.facing(second, s)
            if not -LIMITS.structure_rig_beyond_m <= facing <= second.length + LIMITS.structure_rig_beyond_m:
                raise ValueError(
                    f"{where}: {s:g} m along {first.name!r} faces {facing:.6g} m along {second.name!r}, "
                    f"which is {second.length:.6g} m long"
                )

    def _check_beside(self, where: str, first: BeamPart, second: BeamPart) -> None:
        """A layer's beams lie on each other: parallel, facing along their thickness, and a layer apart."""
        both = f"{where}: {first.name!r} and {second.name!r}"
        if math.hypot(*np.cross(first.axis, second.axis)) > LIMITS.structure_rig_parallel:
            raise ValueError(
                f"{both} are not parallel; for a corner draw a short beam along {first.name!r} that is part of "
                f"{second.name!r}, tied rigidly to its end, and join that"
            )
        if math.hypot(*np.cross(first.normal, second.normal)) > LIMITS.structure_rig_parallel:
            raise ValueError(f"{both} do not face each other with their thickness; see thickness_direction")
        apart = second.origin - first.origin
        sideways = float(apart @ np.cross(first.axis, first.normal))
        if abs(sideways) > LIMITS.structure_rig_aside * min(first.width, second.width):
            raise ValueError(f"{both} lie {abs(sideways):.3g} m beside each other; a layer lies across their thickness")

    def _check_tie(self, where: str, tie: Tie) -> None:
        parts = [self._find(where, name) for name in tie.between]
        if tie.at is not None:
            for part, at in zip(parts, tie.at, strict=True):
                self._check_place(where, part.name, at)
        elif any(isinstance(part, BeamPart) for part in parts):
            raise ValueError(f"{where}: pairs are of parts given by matrices; tie beams by at")

    def _check_force_cell(self) -> None:
        for sensor in self.sensor:
            if sensor.quantity == "force" and (sensor.part, sensor.at) not in [(d.part, d.at) for d in self.drive]:
                raise ValueError(f"sensor {sensor.channel!r}: a force cell sits where a shaker drives")

    def __eq__(self, other: object) -> bool:
        """Whether both say the same; where their files lie is not said in them."""
        return super().__eq__(other.in_folder(self._folder)) if isinstance(other, StructureRig) else NotImplemented

    def in_folder(self, folder: Path | None) -> Self:
        """The same rig, with its files looked for in a folder."""
        rig = self.model_copy()
        rig._folder = folder
        return rig

    def named_from(self, folder: Path) -> StructureRig:
        """The same rig as a file in another folder says it: its parts' files named by the way that leads to them."""
        if self._folder is None or self._folder.resolve() == folder.resolve():
            return self
        home = self._folder.resolve()

        def led_to(table: Table, *names: str) -> Any:
            files = {name: getattr(table, name) for name in names if getattr(table, name)}
            ways = {name: os.path.relpath(home / file, folder.resolve()) for name, file in files.items()}
            return table.model_copy(update={name: Path(way).as_posix() for name, way in ways.items()})

        parts = [led_to(p, "mass", "stiffness", "nodes") if isinstance(p, MatricesPart) else p for p in self.part]
        joints, ties = [led_to(joint, "pairs") for joint in self.joint], [led_to(tie, "pairs") for tie in self.tie]
        return self.model_copy(update={"part": parts, "joint": joints, "tie": ties}).in_folder(folder)

    def layout(self, *, beam_elements: int | None = None, layer_elements: int | None = None) -> Layout:
        """Parts, supports, joints and ties; elements as the file says, or others of each beam and of each layer."""
        return self._layout(lambda own: beam_elements or own, lambda own: layer_elements or own)

    def bench_layout(self) -> Layout:
        """The same with more elements of everything."""
        return self._layout(lambda own: math.ceil(LIMITS.bench_finer * own), lambda own: 2 * own)

    def _layout(self, of_beam: Callable[[int], int], of_layer: Callable[[int], int]) -> Layout:
        """With numbers of elements that follow from the file's own."""
        parts = [_with(part, "elements", of_beam) if isinstance(part, BeamPart) else part for part in self.part]
        joints = [_with(joint, "layer_elements", of_layer) for joint in self.joint]
        stretches = tuple(Stretch(p.name, 0.0, p.length) for p in parts if isinstance(p, BeamPart))
        return Layout(
            tuple(parts), tuple(self.support), tuple(joints), tuple(self.tie), stretches,
            masses=tuple(self.mass), springs=tuple(self.spring), dampers=tuple(self.damper), folder=self._folder,
        )  # fmt: skip

    @property
    def shaker(self) -> PlacedDrive:
        """The one that drives, the first of several."""
        return self.drive[0]

    @property
    def drives(self) -> dict[str, Place]:
        """Where a shaker may drive through a force cell, by name; the one that does comes first."""
        return {drive.name: drive.place for drive in self.drive if drive.name in self.force_cells}

    @property
    def force_cells(self) -> dict[str, str]:
        """Channels of the force cells by their drives' names."""
        cells = {(s.part, s.at): s.channel for s in reversed(self.sensor) if s.quantity == "force"}
        return {d.name: cells[d.part, d.at] for d in self.drive if (d.part, d.at) in cells}

    def driven_by(self, drive: str | None) -> Self:
        """The same rig with that drive first; InputError if it has none of that name with a force cell."""
        rig = super().driven_by(drive)
        return rig.model_copy(update={"drive": sorted(rig.drive, key=lambda one: drive not in (None, one.name))})

    @property
    def drive_place(self) -> Place:
        """Where it drives, and in which direction."""
        return self.drive[0].place

    @property
    def force_sensor(self) -> PlacedSensor:
        """The force cell of the driving shaker; the first one if none sits there."""
        cells = [s for s in self.sensor if s.quantity == "force"]
        here = [s for s in cells if (s.part, s.at) == (self.drive[0].part, self.drive[0].at)]
        return (here or cells)[0]

    def place_of(self, channel: str) -> Place:
        """Where a sensor is and in which direction it measures; a force cell's is its drive's."""
        for sensor in self.sensor:
            if sensor.channel == channel:
                if sensor.quantity != "force":
                    return replace(sensor.place, reads=sensor.reads)
                return next(d.place for d in self.drive if (d.part, d.at) == (sensor.part, sensor.at))
        raise KeyError(channel)

    def with_joints(self, joints: Sequence[ThinLayer]) -> Self:
        """The same rig with these joints' preloads and laws."""
        own = [
            joint.model_copy(update={"preload": other.preload, "law": other.law})
            for joint, other in zip(self.joint, joints, strict=True)
        ]
        return self.model_copy(update={"joint": own})

    def with_moved_sensor(self, channel: str, place: Place) -> Self:
        """The same rig with a sensor elsewhere; a force cell takes its shaker along."""
        moved = next(s for s in self.sensor if s.channel == channel)
        update = {"part": place.part, "at": place.at}
        sensors = [s.model_copy(update=update) if s is moved else s for s in self.sensor]
        drives = self.drive
        if moved.quantity == "force":
            drives = [d.model_copy(update=update) if (d.part, d.at) == (moved.part, moved.at) else d for d in drives]
        return self.model_copy(update={"sensor": sensors, "drive": drives})

    def hit_at(self, place: Place) -> Self:
        """The same rig hit there by a hammer: its cell is the driving one's, its mass on nobody's side."""
        self._check_place("point", place.part, place.at)
        self._check_plane("point", place)
        there: dict[str, Any] = {"part": place.part, "at": place.at, "direction": list(place.direction)}
        cell = self.force_sensor.model_copy(update={**there, "mass": 0.0, "stinger_side_mass": 0.0})
        sensors = [cell, *self.response_sensors]
        return self.model_copy(update={"sensor": sensors, "drive": [PlacedDrive(name=self.shaker.name, **there)]})


def _with(table: Meshed, field: str, changed: Callable[[int], int]) -> Meshed:
    """A table with another number of elements; itself where it is the same."""
    own = getattr(table, field)
    return table if changed(own) == own else table.model_copy(update={field: changed(own)})
