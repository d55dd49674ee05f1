"""A rig's substructures: receptances of its modelled parts, and of its measured ones from their files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from recordings.directions import AXES
from recordings.errors import InputError, blamed_on
from twin.arrays import Array
from twin.identify.linear.receptance import ModalBasis, lowest_modes_basis
from twin.rigs import BeamPart, Place, moduli_values
from twin.rigs.substructures import Connection, SubstructuresRig
from twin.structure import Structure, assemble
from twin.substructuring.coupling import Coupled, couple
from twin.substructuring.expansion import Expansion
from twin.substructuring.measured_part import measured_receptance, same_lines
from twin.substructuring.synthesis import Synthesis


@dataclass(frozen=True, eq=False)
class MeasuredSubstructure:
    """A measured part among the ports."""

    name: str
    ports: Array
    """Which of all ports are its own, (g,)."""
    points: Array | None
    """Of a part with a model: which of these ports its points are."""
    synthesis: Synthesis
    """Of the receptances between the points."""


@dataclass(frozen=True, eq=False)
class Substructures:
    """All ports of all substructures, and the gaps between them."""

    rig: SubstructuresRig
    basis: ModalBasis
    """Of all modelled parts, uncoupled."""
    rows: Array
    """Ports on modelled parts, (m, n): drives and sensors first; then come the points of measured parts without a
    model."""
    gaps: Array
    """B of :func:`~twin.substructuring.coupling.couple`, (c, p); viscous dampers of modelled parts are gaps to the
    ground."""
    joints: tuple[tuple[Connection, str], ...]
    """Connection and motion of each gap; the others are dampers."""
    parts: tuple[MeasuredSubstructure, ...]
    frequency_Hz: Array
    """Lines of the measured parts, (f,)."""

    def with_vectors(self, vectors: Sequence[Array]) -> Substructures:
        """The same with other parameters of the measured parts."""
        parts = zip(self.parts, vectors, strict=True)
        return replace(self, parts=tuple(
            replace(part, synthesis=replace(part.synthesis, vector=vector)) for part, vector in parts
        ))  # fmt: skip

    def uncoupled(self, omega: Array) -> tuple[Array, tuple[Expansion, ...]]:
        """Receptances (f, p, p) of the modelled parts, and how those of each measured part are made."""
        m, p = len(self.rows), self.gaps.shape[1]
        Y = np.zeros((len(omega), p, p), complex)
        Y[:, :m, :m] = self.basis.receptance(self.rows, omega)
        return Y, tuple(
            Expansion.of_points(len(omega), len(part.ports)) if part.points is None
            else Expansion.by_model(Y[:, part.ports[:, None], part.ports], part.points)
            for part in self.parts
        )  # fmt: skip

    def coupled(self, omega: Array, Y: Array, expansions: Sequence[Expansion], flexibility: Array) -> Coupled:
        """All coupled by joints of this flexibility (f, j); Y and the expansions as of :meth:`uncoupled`.

        InputError if the interface is singular.
        """
        whole = Y.copy()
        for part, expansion in zip(self.parts, expansions, strict=True):
            whole[:, part.ports[:, None], part.ports] = expansion.receptance(part.synthesis.receptance(omega))
        dampers = np.repeat(1 / (1j * omega[:, None]), len(self.gaps) - len(self.joints), axis=1)
        with blamed_on(self.rig.name, "connection", "leave one of the connections out"):
            return couple(whole, self.gaps, np.hstack([flexibility, dampers]))


def gather_substructures(rig: SubstructuresRig, *, preload: str | None = None) -> Substructures:
    """Assemble the modelled parts, read and synthesise the measured ones.

    Parameters
    ----------
    preload
        State of the modelled parts' own joints.

    Raises
    ------
    InputError
        If a file cannot be read, or does not hold what the rig file asks of it.
    """
    structure, ports = assemble(rig), _Ports()
    for place in (*rig.drives.values(), *(rig.place_of(sensor.channel) for sensor in rig.response_sensors)):
        ports.add(structure.row(place), place.part)
    joints = tuple((one, dof) for one in rig.connection for dof in (*one.rigid, *one.stiffness))
    ends = [
        tuple((name, at) if isinstance(at, str) else ports.add(_motion(rig, structure, one, name, at, dof), name)
              for name, at in zip(one.between, one.at, strict=True))
        for one, dof in joints
    ]  # fmt: skip
    dampers = [ports.add(row, "") for row in structure.B_C]
    parts = []
    lines: Array | None = None
    for part in rig.measured_part:
        axes = {name: _axis(structure, part.name) for name in part.points} or {
            at: dof for one, dof in joints for name, at in zip(one.between, one.at, strict=True)
            if name == part.name and isinstance(at, str)
        }  # fmt: skip
        frequency_Hz, synthesis = measured_receptance(rig, part, axes)
        if lines is not None and not same_lines(lines, frequency_Hz):
            raise InputError(part.responses, "", "has other lines than the other measured part", "export both alike")
        lines = frequency_Hz
        points = [
            ports.add(structure.motion(Place(part.name, at, AXES["y"]), axes[name]), part.name)
            for name, at in part.points.items()
        ]
        if points:
            own = np.array([port for port, name in enumerate(ports.owners) if name == part.name])
            parts.append(MeasuredSubstructure(part.name, own, np.searchsorted(own, points), synthesis))
        else:
            parts.append(MeasuredSubstructure(part.name, np.array([]), None, synthesis))
            ports.points += [(part.name, name) for name in axes]
    where = {point: len(ports.rows) + number for number, point in enumerate(ports.points)}
    parts = [
        part if part.points is not None
        else replace(part, ports=np.array([port for (name, _), port in where.items() if name == part.name]))
        for part in parts
    ]  # fmt: skip
    gaps = np.zeros((len(joints) + len(dampers), len(ports.rows) + len(where)))
    for gap, pair in zip(gaps, ends, strict=False):
        for sign, end in zip((-1, 1), pair, strict=True):
            gap[where[end] if isinstance(end, tuple) else end] += sign
    gaps[len(joints) + np.arange(len(dampers)), dampers] = 1
    rows = np.array(ports.rows)
    rigid = np.array([dof in one.rigid for one, dof in joints] + [False] * len(dampers))
    closed = np.hstack([gaps[rigid, : len(rows)] @ rows, gaps[rigid, len(rows) :]])
    if np.linalg.matrix_rank(closed) < len(closed):
        raise InputError(rig.name, "connection", "a gap is closed rigidly twice", "leave one of the connections out")
    basis = lowest_modes_basis(
        structure.M, structure.stiffness(*moduli_values(rig, preload)), np.array(rig.damping.modal_ratio),
        kept=structure.size,
    )  # fmt: skip
    assert lines is not None
    return Substructures(rig, basis, rows, gaps, joints, tuple(parts), lines)


@dataclass
class _Ports:
    """Ports as they are found: on modelled parts by their rows and whose they are; points of parts without a model."""

    rows: list[Array] = field(default_factory=list)
    owners: list[str] = field(default_factory=list)
    points: list[tuple[str, str]] = field(default_factory=list)

    def add(self, row: Array, owner: str) -> int:
        """A port on a modelled part; its number."""
        self.rows.append(row)
        self.owners.append(owner)
        return len(self.rows) - 1


def _motion(
    rig: SubstructuresRig, structure: Structure, connection: Connection, name: str, at: float, dof: str
) -> Array:
    with blamed_on(rig.name, f"connection {connection.name!r}"):
        return structure.motion(Place(name, at, AXES["y"]), dof)


def _axis(structure: Structure, name: str) -> str:
    """The axis nearest to a beam's normal, along which its points are taken to be read; y of other parts."""
    part = structure.layout.part(name)
    return "xyz"[int(np.argmax(np.abs(part.normal)))] if isinstance(part, BeamPart) else "y"
