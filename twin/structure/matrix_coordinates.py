"""A part given by matrices, reduced, among all displacements of a structure."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from recordings.directions import AXES
from recordings.errors import InputError, blamed_on
from twin.arrays import Array
from twin.rigs import Layout, MatricesPart, Rig
from twin.rigs.layout import DOFS
from twin.rigs.matrix_files import NodePairs, PartMatrices, part_matrices, read_pairs
from twin.structure.craig_bampton import ReducedPart, cached_craig_bampton
from twin.structure.limits import LIMITS
from twin.structure.node_field import NodeField


@dataclass(frozen=True, eq=False)
class MatrixCoordinates:
    """Coordinates of a reduced part."""

    part: MatricesPart
    matrices: PartMatrices
    reduced: ReducedPart
    first: int
    """Number of its first coordinate among all displacements of the structure."""

    @property
    def size(self) -> int:
        """Number of coordinates."""
        return len(self.reduced.M)

    def dof(self, node: float, name: str) -> tuple[Array, Array] | None:
        """Coordinates and coefficients of a node's displacement or rotation; None where it has none."""
        row = self.matrices.rows.get((int(node), name))
        if row is None:
            return None
        return self.first + np.arange(self.size), self.reduced.T[row]

    def translation(self, node: float, direction: Sequence[float]) -> tuple[Array, Array]:
        """The same of its displacement in a direction."""
        try:
            self.matrices.coordinates_of(int(node))
        except KeyError:
            raise ValueError(f"part {self.part.name!r} has no node {node:g}") from None
        row = np.zeros(self.size)
        for axis, share in zip(AXES, direction, strict=True):
            found = self.dof(node, axis)
            if share and found is not None:
                row += share * found[1]
        return self.first + np.arange(self.size), row

    @property
    def told(self) -> str:
        """What its reduction kept and how well, in words."""
        whole, few = self.reduced.T.shape
        return (
            f"{whole} degrees of freedom in {few}; natural frequencies up to {self.part.modes_to_Hz:g} Hz are those of "
            f"the whole within {max(self.reduced.error, LIMITS.coordinate_rounding):.0e}"
        )

    @cached_property
    def field(self) -> NodeField:
        """The nodes, to search a place among them."""
        nodes, named = self.matrices.nodes, {name for _, name in self.matrices.rows}
        points = np.array([self.coordinates(node) for node in nodes])
        x, y, z = (axis in named for axis in AXES)
        return NodeField.of(np.asarray(nodes, np.int64), points, moving=(x, y, z))

    def coordinates(self, node: float) -> Array:
        """Coordinates (3,) of a node, m."""
        return np.asarray(self.matrices.coordinates_of(int(node)))

    def rigid_translation(self, direction: Sequence[float]) -> Array:
        """Coordinates (size,) of a unit translation."""
        whole = np.zeros(len(self.reduced.T))
        for (_, name), row in self.matrices.rows.items():
            if name in AXES:
                whole[row] = direction[DOFS.index(name)]
        return np.asarray(np.linalg.lstsq(self.reduced.T, whole, rcond=None)[0])


def node_pairs(layout: Layout, name: str, *, where: str, parts: Sequence[PartMatrices]) -> NodePairs:
    """The pairs of a joint or a tie, whose nodes its parts must have."""
    path = layout.file(name, where)
    pairs = read_pairs(path)
    for side, nodes, matrices in (("node_a", pairs.a, parts[0]), ("node_b", pairs.b, parts[1])):
        unknown = sorted(set(nodes.tolist()) - set(matrices.nodes.tolist()))
        if unknown:
            raise InputError(path, side, f"no node {unknown[0]} in that part", "take the nodes of its own table")
    return pairs


def reduced_parts(layout: Layout, rig: Rig, *, first: int) -> tuple[MatrixCoordinates, ...]:
    """The layout's parts given by matrices, reduced to what is attached to them and to their lowest modes.

    InputError if a file cannot be read or does not fit.

    Parameters
    ----------
    rig
        Whose shaker and sensors are attached.
    first
        Number of the first coordinate.
    """
    found: list[MatrixCoordinates] = []
    parts = [part for part in layout.parts if isinstance(part, MatricesPart)]
    read = {part.name: part_matrices(layout, part) for part in parts}
    for part, matrices in zip(parts, read.values(), strict=True):
        known = set(matrices.nodes.tolist())
        nodes = dict.fromkeys(_attached(layout, rig, part.name, read))
        missing = [node for node in nodes if node not in known]
        if missing:
            table = layout.file(part.nodes, part.name)
            reason = f"part {part.name!r} has no node {missing[0]}"
            raise InputError(table, "node", reason, "supports, shakers, sensors, joints and ties sit at nodes of it")
        rows = [
            row for node in nodes for name in DOFS
            if (row := matrices.rows.get((node, name))) is not None
        ]  # fmt: skip
        with blamed_on(layout.file(part.stiffness, part.name), f"part {part.name!r}"):
            reduced = cached_craig_bampton(
                matrices, np.array(rows, np.int64), modes_to_Hz=part.modes_to_Hz, folder=layout.folder
            )
        found.append(MatrixCoordinates(part, matrices, reduced, first))
        first += found[-1].size
    return tuple(found)


def _attached(layout: Layout, rig: Rig, name: str, read: dict[str, PartMatrices]) -> Iterable[int]:
    """Nodes of a part that something is attached to."""
    for part, at in layout.attached:
        if part == name:
            yield int(at)
    for place in [rig.drive_place, *(rig.place_of(sensor.channel) for sensor in rig.sensor)]:
        if place.part == name:
            yield int(place.at)
    joined = [(j.between, j.pairs) for j in layout.joints] + [(tie.between, tie.pairs) for tie in layout.ties]
    for between, file in joined:
        if file is not None and name in between:
            pairs = node_pairs(layout, file, where="pairs", parts=[read[n] for n in between])
            yield from (pairs.a if between[0] == name else pairs.b).tolist()
