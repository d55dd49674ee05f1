"""What a structure is made of: parts, supports, thin-layer joints, ties, and places on them.

These are the tables of a rig file of format 2; a file of format 1 is read as them.
"""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Annotated, Literal, get_args

from pydantic import Field, model_validator

from recordings.directions import cosine, direction_name
from recordings.errors import InputError
from recordings.numbers import Length, Mass, NonNegative, Positive
from recordings.toml_input import Name, Table
from twin.rigs.beam_part import BeamPart
from twin.rigs.limits import LIMITS
from twin.rigs.tables import AnyLaw, Preload, check_law

Dof = Literal["x", "y", "z", "rx", "ry", "rz"]
DOFS: tuple[str, ...] = get_args(Dof)
"""Displacements along, and rotations about, the axes."""
At = Annotated[float, Field(ge=0, le=1e9, allow_inf_nan=False)]
"""Metres along a beam part, or a node number of a part given by matrices."""


class MatricesPart(Table):
    """A part given by its mass and stiffness matrices, files beside the rig file."""

    name: Name
    kind: Literal["matrices"]
    mass: str
    stiffness: str
    nodes: str
    """Table of node, dof, row of the matrices and coordinates."""
    modes_to_Hz: Positive
    """What its reduction must keep."""


Part = BeamPart | MatricesPart


class Support(Table):
    """What holds a part at one place: fixed directions, springs to ground, or both."""

    part: Name
    at: At
    fix: list[Dof] = Field(default=[])
    stiffness: dict[Dof, Positive] = Field(default={})
    """N/m, and N m/rad of rotations."""

    @model_validator(mode="after")
    def _holds(self) -> Support:
        if not self.fix and not self.stiffness:
            raise ValueError("it holds nothing: give fix, stiffness or both")
        both = set(self.fix) & set(self.stiffness)
        if both:
            raise ValueError(f"{', '.join(sorted(both))} cannot be fixed and on a spring")
        return self

    @property
    def holds_rotation(self) -> bool:
        """Whether it resists a turn in the plane, rigidly or by a spring."""
        return "rz" in self.fix or "rz" in self.stiffness

    def yielding(self, rad_per_Nm: float) -> Support:
        """The same with a rotational spring in series; itself where it does not resist a turn."""
        if not self.holds_rotation:
            return self
        compliance = rad_per_Nm + (1.0 / self.stiffness["rz"] if "rz" in self.stiffness else 0.0)
        spring = {**self.stiffness, "rz": 1.0 / compliance}
        return self.model_copy(update={"fix": [d for d in self.fix if d != "rz"], "stiffness": spring})


class ThinLayer(Table):
    """A joint between two parts: a thin layer with a normal modulus E' and a shear modulus G'."""

    name: Name
    kind: Literal["thin-layer"]
    between: tuple[Name, Name]
    begin: NonNegative | None = Field(default=None, alias="from")
    """Where it begins and ends along the first of two beam parts, m."""
    to: Positive | None = None
    pairs: str | None = None
    """Of parts given by matrices: table of facing nodes with their areas and normals."""
    layer_height: Length
    """From neutral axis to neutral axis where it joins beams."""
    width: Length | None = None
    layer_elements: Annotated[int, Field(ge=1, le=50)] = 3
    preload: dict[str, Preload] = Field(min_length=1)
    law: AnyLaw | None = None

    @model_validator(mode="after")
    def _somewhere(self) -> ThinLayer:
        along = self.begin is not None and self.to is not None
        if along == (self.pairs is not None) or (self.begin is None) != (self.to is None):
            raise ValueError("it lies either from .. to .. along its first beam, or between pairs of nodes")
        if self.begin is not None and self.to is not None and self.to <= self.begin:
            raise ValueError(f"to {self.to:g} must lie beyond from {self.begin:g}")
        if self.between[0] == self.between[1]:
            raise ValueError(f"it joins {self.between[0]!r} to itself")
        check_law(self.law, self.preload)
        return self


class Tie(Table):
    """A rigid connection of two parts, at one place or at pairs of nodes."""

    between: tuple[Name, Name]
    at: tuple[At, At] | None = None
    """Along the first and along the second: rigid in x, y and rz."""
    pairs: str | None = None
    """Table of facing nodes: rigid in x, y and z."""

    @model_validator(mode="after")
    def _somewhere(self) -> Tie:
        if (self.at is None) == (self.pairs is None):
            raise ValueError("give either at or pairs")
        if self.between[0] == self.between[1]:
            raise ValueError(f"it ties {self.between[0]!r} to itself")
        return self


class PointMass(Table):
    """A lump fixed to a part at one place."""

    part: Name
    at: At
    name: Name = ""
    """By which answers call it; its part and place if left out."""
    mass: Mass
    """kg, in every direction in which the place moves."""
    inertia: dict[Literal["rx", "ry", "rz"], Positive] = Field(default={})
    """About its own centre, kg m2."""


class Link(Table):
    """What acts between two places, along the axes and about them; it has no length."""

    between: tuple[Name, Name]
    at: tuple[At, At]


class Spring(Link):
    """Springs between two places."""

    stiffness: dict[Dof, Positive] = Field(min_length=1)
    """N/m, and N m/rad of rotations."""


class Damper(Link):
    """Viscous dampers between two places."""

    damping: dict[Dof, Positive] = Field(min_length=1)
    """N s/m, and N m s/rad of rotations."""


@dataclass(frozen=True)
class Place:
    """A point of a part and a direction there."""

    part: str
    at: float
    """Metres along a beam from its start, or a node number of a part given by matrices."""
    direction: tuple[float, float, float]
    """Unit vector, (3,)."""
    between: tuple[tuple[int, float], ...] = ()
    """Nodes and their shares in the motion of a place between them; empty at a node or on a beam."""
    reads: str = "displacement"
    """``displacement`` in that direction, or ``strain`` along a beam at the surface that faces in that direction."""

    def faces_against(self, recorded: str) -> bool:
        """Whether a recording's direction points against this one.

        Recordings of programs that know +y and -y alone say -y of what measures against the sum of the axes.
        ValueError if the two lie across each other.
        """
        along = cosine(recorded, self.direction)
        if abs(along) > LIMITS.layout_across:
            return along < 0
        if recorded in ("+y", "-y"):
            return recorded.startswith("-") != (sum(self.direction) < 0)
        raise ValueError(f"it was recorded along {recorded}, and the rig has it along {direction_name(self.direction)}")

    def towards(self, direction: tuple[float, float, float]) -> Place:
        """The displacement of the same point in another direction."""
        return replace(self, direction=direction, reads="displacement")


@dataclass(frozen=True)
class Stretch:
    """A piece of a beam part, from .. to .. metres along it."""

    part: str
    begin: float
    end: float

    @property
    def length(self) -> float:
        """Metres."""
        return self.end - self.begin


@dataclass(frozen=True)
class Layout:
    """A structure's parts and how they hang together."""

    parts: tuple[Part, ...]
    supports: tuple[Support, ...]
    joints: tuple[ThinLayer, ...]
    ties: tuple[Tie, ...]
    stretches: tuple[Stretch, ...]
    """Beams, or pieces of them, one behind the other: a number of metres along them is a place."""
    passable: bool = False
    """Whether the end of a stretch is where the next begins, so that what is moved may pass from one to the next."""
    masses: tuple[PointMass, ...] = ()
    springs: tuple[Spring, ...] = ()
    dampers: tuple[Damper, ...] = ()
    folder: Path | None = field(default=None, compare=False)
    """Where the parts' files lie; None where nobody knows."""

    @property
    def beams(self) -> tuple[BeamPart, ...]:
        """The parts that are beams."""
        return tuple(part for part in self.parts if isinstance(part, BeamPart))

    def halved(self) -> Layout:
        """The same with every element of a beam and of a layer cut in two; parts given by matrices stay."""
        parts = (part.model_copy(update={"elements": 2 * part.elements}) for part in self.beams)
        finer = {part.name: part for part in parts}
        layers = (joint.model_copy(update={"layer_elements": 2 * joint.layer_elements}) for joint in self.joints)
        return replace(self, parts=tuple(finer.get(part.name, part) for part in self.parts), joints=tuple(layers))

    def file(self, name: str, where: str) -> Path:
        """Where a file of a part, a joint or a tie lies; InputError with `where` it is named if nobody knows."""
        if self.folder is None:
            raise InputError(name, where, "nobody knows where this file lies", "give the rig file itself with --rig")
        return self.folder / name

    @property
    def attached(self) -> tuple[tuple[str, float], ...]:
        """Part and place of every support, lump and end of a link or a tie, but for ties of pairs of nodes."""
        links = (*self.springs, *self.dampers)
        ends = [end for link in links for end in zip(link.between, link.at, strict=True)]
        ends += [end for tie in self.ties if tie.at for end in zip(tie.between, tie.at, strict=True)]
        return (*((s.part, s.at) for s in self.supports), *((m.part, m.at) for m in self.masses), *ends)

    def part(self, name: str) -> Part:
        """The part of that name; KeyError if there is none."""
        for part in self.parts:
            if part.name == name:
                return part
        raise KeyError(name)

    def beam(self, name: str) -> BeamPart:
        """The beam of that name; KeyError if there is none."""
        part = self.part(name)
        if not isinstance(part, BeamPart):
            raise KeyError(name)
        return part

    def with_beam(self, name: str, *, youngs_modulus: float, shear_ratio: float) -> Layout:
        """The same with another beam in its place."""
        changed = self.beam(name).model_copy(update={"youngs_modulus": youngs_modulus, "shear_ratio": shear_ratio})
        return replace(self, parts=tuple(changed if part.name == name else part for part in self.parts))

    def with_yielding_supports(self, rad_per_Nm: float, *, part: str | None = None) -> Layout:
        """The same with supports that yield more in rotation, or at all: those of one part, or all."""
        supports = [s.yielding(rad_per_Nm) if part in (None, s.part) else s for s in self.supports]
        return replace(self, supports=tuple(supports))

    @property
    def length(self) -> float:
        """Of all stretches together, m."""
        return sum(stretch.length for stretch in self.stretches)

    def place(self, position_m: float) -> Place:
        """The place so many metres along the stretches, across its beam; ValueError if it lies beyond their ends."""
        left = position_m
        for stretch in self.stretches:
            if left <= stretch.length + LIMITS.layout_rounded_m and left >= -LIMITS.layout_rounded_m:
                normal = self.beam(stretch.part).normal
                at = min(max(stretch.begin + left, stretch.begin), stretch.end)
                return Place(stretch.part, at, normal)
            left -= stretch.length
        raise ValueError(f"position {position_m} m is not on the structure")

    def position(self, place: Place) -> float | None:
        """How many metres along the stretches a place lies; None where it is on none of them."""
        before = 0.0
        for stretch in self.stretches:
            if stretch.part == place.part and place.at <= stretch.end + LIMITS.layout_rounded_m:
                return before + max(place.at - stretch.begin, 0.0)
            before += stretch.length
        return None

    def reach(self, place: Place) -> tuple[float, float]:
        """How far a place may be moved back and forth, m; nowhere from a node."""
        if self.passable:
            position = self.position(place) or 0.0
            return position, self.length - position
        part = self.part(place.part)
        return (place.at, part.length - place.at) if isinstance(part, BeamPart) else (0.0, 0.0)

    def told(self, place: Place) -> str:
        """A place in words, such as ``0.3 m`` or ``bracket, node 12``."""
        if self.passable:
            return f"{self.position(place):g} m"
        unit = f"{place.at:g} m" if isinstance(self.part(place.part), BeamPart) else f"node {place.at:g}"
        return f"{place.part}, {unit}"

    def moved(self, place: Place, offset_m: float) -> Place:
        """The place shifted along its beam, no farther than to its end; a node stays where it is."""
        if self.passable:
            position = self.position(place)
            assert position is not None
            other = self.place(min(max(position + offset_m, 0.0), self.length))
            return replace(other, direction=place.direction, reads=place.reads)
        part = self.part(place.part)
        if not isinstance(part, BeamPart):
            return place
        return replace(place, at=min(max(place.at + offset_m, 0.0), part.length))
