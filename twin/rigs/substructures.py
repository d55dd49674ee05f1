"""Rig files of ``kind = "substructures"``: parts by models, parts known by their responses, and joints between them."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field, model_validator

from recordings.directions import AXES
from recordings.numbers import Positive
from recordings.toml_input import Name, Table
from twin.rigs.layout import At, Dof
from twin.rigs.rig import unique
from twin.rigs.structure_rig import StructureRig


class MeasuredPart(Table):
    """A part known by its frequency responses between points."""

    name: Name
    """Of its own; or that of a part, on whose model the responses are expanded."""
    responses: str
    """File beside the rig file: every point hit, every point read."""
    points: dict[Name, At] = Field(default={})
    """Where on that model the file's points lie."""


class Connection(Table):
    """A joint between two substructures, at one place of each, or at a point of a measured part."""

    name: Name
    between: tuple[Name, Name]
    at: tuple[At | Name, At | Name]
    """As everywhere along a part; of a measured part without a model, the point by its name in the file."""
    stiffness: dict[Dof, Positive] = Field(default={})
    """N/m, and N m/rad of rotations."""
    rigid: list[Dof] = Field(default=[])
    loss_factor: Annotated[float, Field(ge=0, le=1)] = 0.0
    """Imaginary part of the stiffness over the real one."""

    @model_validator(mode="after")
    def _closes(self) -> Connection:
        dofs = [*self.rigid, *self.stiffness]
        if not dofs or len(set(dofs)) < len(dofs):
            raise ValueError("give each motion that it joins once, in stiffness or in rigid")
        if any(isinstance(at, str) for at in self.at) and (len(dofs) > 1 or dofs[0] not in AXES):
            raise ValueError("a point of a measured part moves along one axis: join that one")
        if self.between[0] == self.between[1]:
            raise ValueError(f"it joins {self.between[0]!r} to itself")
        return self


class SubstructuresRig(StructureRig):
    """A structure of which some parts are known by their responses."""

    kind: Literal["substructures"]
    measured_part: list[MeasuredPart] = Field(min_length=1, max_length=20)
    connection: list[Connection] = Field(min_length=1, max_length=50)

    @model_validator(mode="after")
    def _connected(self) -> SubstructuresRig:
        unique("measured parts' names", [one.name for one in self.measured_part])
        unique("connections' names", [one.name for one in self.connection])
        if self.effect or self.natural_frequencies.offset:
            raise ValueError("effect and natural_frequencies belong to a whole structure, not to its parts")
        modelled, bare = {part.name for part in self.part}, set()
        links = [link.between for kind in (self.joint, self.tie, self.spring, self.damper) for link in kind]
        fixed = {name for between in links for name in between}
        for one in self.measured_part:
            where = f"measured_part {one.name!r}"
            if one.name not in modelled:
                bare.add(one.name)
                if one.points:
                    raise ValueError(f"{where}: points lie on a model, and there is no part of this name")
                continue
            if not one.points:
                raise ValueError(f"{where}: points say where on the part its responses were measured")
            if one.name in fixed:
                raise ValueError(f"{where}: is joined, tied or linked in the model; use connections")
            for point in one.points.values():
                self._check_place(where, one.name, point)
        for connection in self.connection:
            where = f"connection {connection.name!r}"
            for name, at in zip(connection.between, connection.at, strict=True):
                if name not in bare:
                    self._find(where, name)
                if (name in bare) != isinstance(at, str):
                    raise ValueError(f"{where}: {name!r} is joined at {'a point' if name in bare else 'a number'}")
                if not isinstance(at, str):
                    self._check_place(where, name, at)
                    self._check_moves(where, name, [*connection.rigid, *connection.stiffness])
        joined = {name for connection in self.connection for name in connection.between}
        for one in self.measured_part:
            if one.name not in joined:
                raise ValueError(f"measured_part {one.name!r}: no connection joins it")
        return self
