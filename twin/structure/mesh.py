"""Nodes of the beams of a layout: where a layer, a support or a tie needs them, and evenly between."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from twin.arrays import Array
from twin.rigs import BeamPart, Layout, ThinLayer
from twin.rigs.layout import DOFS
from twin.structure.elements.beam import deflection_shape, rotation_rate_shape
from twin.structure.elements.space_beam import AGAINST, AXIAL, BENT, BENT_ACROSS
from twin.structure.limits import LIMITS

PLANE_DOFS = ("x", "y", "rz")
"""Of a plane beam's node."""


@dataclass(frozen=True, eq=False)
class BeamMesh:
    """A beam's nodes, and where its displacements stand among all."""

    part: BeamPart
    s: Array
    """Metres along the beam, (k,)."""
    first: int
    """Number of its first degree of freedom; a node has `dofs`."""
    near: float
    """So far from a node a place may lie that is to have it, m."""

    @property
    def dofs(self) -> tuple[str, ...]:
        """Names of a node's degrees of freedom."""
        return DOFS if self.part.in_space else PLANE_DOFS

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return len(self.dofs) * len(self.s)

    @cached_property
    def frame(self) -> Array:
        """Components of axis, normal and the direction across both in x, y and z, (3, 3)."""
        return np.array([self.part.axis, self.part.normal, np.cross(self.part.axis, self.part.normal)])

    @property
    def points(self) -> Array:
        """Coordinates of the nodes, (k, 3)."""
        return self.coordinates(self.s)

    def coordinates(self, s: float | Array) -> Array:
        """Coordinates (..., 3) of places `s` (...) along the beam, m."""
        return np.asarray(self.part.origin + np.asarray(s, float)[..., None] * np.array(self.part.axis))

    @property
    def element_dofs(self) -> Array:
        """Degrees of freedom of each element, (e, 6) or (e, 12)."""
        n = len(self.dofs)
        return np.asarray(self.first + n * np.arange(len(self.s) - 1)[:, None] + np.arange(2 * n))

    def node_dofs(self, s: float) -> Array:
        """Degrees of freedom of the node at `s`; ValueError where there is none."""
        node = int(np.argmin(np.abs(self.s - s)))
        if abs(self.s[node] - s) > max(self.near, LIMITS.mesh_beyond_m):
            raise ValueError(f"no node of {self.part.name!r} at {s} m")
        return self.first + len(self.dofs) * node + np.arange(len(self.dofs))

    def dof(self, s: float, name: str) -> tuple[Array, Array] | None:
        """Degree of freedom and coefficient of one motion of the node at `s`; None where it has none."""
        return (self.node_dofs(s)[[self.dofs.index(name)]], np.ones(1)) if name in self.dofs else None

    def translation(self, s: float, direction: Sequence[float]) -> tuple[Array, Array]:
        """Degrees of freedom and coefficients of the displacement at `s` in a direction."""
        shares = self.frame @ np.array(direction)
        return self._row(s, lambda xi, length: (
            shares[0] * np.array([1 - xi, xi]), *(share * deflection_shape(xi, length) for share in shares[1:])
        ))  # fmt: skip

    def slope(self, s: float) -> tuple[Array, Array]:
        """The same of the deflection's derivative along the beam."""
        return self._row(s, lambda xi, length: (np.zeros(2), deflection_shape(xi, length, 1), np.zeros(4)))

    def strain(self, s: float, *, side: float) -> tuple[Array, Array]:
        """The same of the strain at a surface, half a thickness to the left (+1) or to the right (-1) of the axis."""
        part = self.part
        off = side * part.thickness / 2

        def shapes(xi: float, length: float) -> tuple[Array, Array, Array]:
            shear = 12.0 * part.second_moment / part.area * part.shear_ratio / length**2
            return np.array([-1.0, 1.0]) / length, -off * rotation_rate_shape(xi, length, shear), np.zeros(4)

        return self._row(s, shapes)

    def rigid_translation(self, direction: Sequence[float]) -> Array:
        """Displacements (size,) of a unit translation."""
        at_node = [direction["xyz".index(name)] if name in "xyz" else 0.0 for name in self.dofs]
        return np.tile(at_node, len(self.s))

    def _row(self, s: float, shapes) -> tuple[Array, Array]:  # type: ignore[no-untyped-def]
        if not -LIMITS.mesh_beyond_m <= s <= self.s[-1] + LIMITS.mesh_beyond_m:
            raise ValueError(f"{s} m is not on {self.part.name!r}")
        s = min(max(s, 0.0), self.s[-1])
        e = int(np.clip(np.searchsorted(self.s, s) - 1, 0, len(self.s) - 2))
        length = self.s[e + 1] - self.s[e]
        local = np.zeros(2 * len(self.dofs))
        along, bent, across = shapes((s - self.s[e]) / length, length)
        if self.part.in_space:
            local[AXIAL], local[BENT], local[BENT_ACROSS] = along, bent, across * AGAINST
        else:
            local[[0, 3]], local[[1, 2, 4, 5]] = along, bent
        return self.element_dofs[e], local @ self.rotation

    @property
    def rotation(self) -> Array:
        """Of an element's degrees of freedom from x, y, z to axis, normal and across both, (6, 6) or (12, 12)."""
        if self.part.in_space:
            return np.asarray(np.kron(np.eye(4), self.frame), float)
        turn = np.eye(6)
        turn[0:2, 0:2] = turn[3:5, 3:5] = self.frame[:2, :2]
        return turn


@dataclass(frozen=True, eq=False)
class LayerMesh:
    """Where the elements of a layer between two beams begin and end, m along the first and along the second."""

    joint: ThinLayer
    first: Array
    second: Array


def mesh_layers(layout: Layout) -> tuple[LayerMesh, ...]:
    """Element borders of the layers between beams, at what other joints, supports and ties need within them, too."""
    joints = [joint for joint in layout.joints if joint.begin is not None]
    needed, near = _single_nodes(layout), _near(layout)
    borders = [np.linspace(float(j.begin or 0.0), float(j.to or 0.0), j.layer_elements + 1) for j in joints]
    for _ in range(len(joints) + 1):
        for number, joint in enumerate(joints):
            first, second = (layout.beam(name) for name in joint.between)
            own = [needed.get(first.name, np.zeros(0)), _facing(second, first, needed.get(second.name, np.zeros(0)))]
            for other, at in zip(joints, borders, strict=True):
                one, two = (layout.beam(name) for name in other.between)
                if other is not joint:
                    own += [_facing(one, first, at)] if one.name in joint.between else []
                    own += [_facing(two, first, _facing(one, two, at))] if two.name in joint.between else []
            inside = np.concatenate(own)
            inside = inside[(inside > borders[number][0]) & (inside < borders[number][-1])]
            borders[number] = _merged(borders[number], inside, near)
    return tuple(
        LayerMesh(joint, at, _facing(layout.beam(joint.between[0]), layout.beam(joint.between[1]), at))
        for joint, at in zip(joints, borders, strict=True)
    )


def mesh_beams(layout: Layout, layers: Sequence[LayerMesh]) -> tuple[BeamMesh, ...]:
    """Nodes of every beam: the layers' borders, supports, ties, and evenly between as many as the part asks for."""
    needed, near, first, meshes = _single_nodes(layout), _near(layout), 0, []
    for beam in layout.beams:
        own = [layer.first for layer in layers if layer.joint.between[0] == beam.name]
        own += [np.sort(layer.second) for layer in layers if layer.joint.between[1] == beam.name]
        s = _beam_nodes(beam, own, needed.get(beam.name, np.zeros(0)), near)
        meshes.append(BeamMesh(beam, s, first, near))
        first += meshes[-1].size
    return tuple(meshes)


def _beam_nodes(beam: BeamPart, layers: Sequence[Array], single: Array, near: float) -> Array:
    needed = np.clip(np.concatenate([*layers, single]), 0.0, beam.length)
    nodes = _merged(np.array([0.0, beam.length]), needed, near)
    inside = np.zeros(len(nodes) - 1, bool)
    for at in layers:
        inside[np.argmin(np.abs(nodes - at[0])) : np.argmin(np.abs(nodes - at[-1]))] = True
    lengths = np.diff(nodes)
    count = np.where(inside, 1, 0)
    outside = np.flatnonzero(~inside)
    if len(outside):
        count[outside] = _shares(lengths[outside], beam.elements - int(inside.sum()))
    pieces = [np.linspace(a, b, n + 1)[:-1] for a, b, n in zip(nodes[:-1], nodes[1:], count, strict=True)]
    return np.concatenate([*pieces, nodes[-1:]])


def _shares(lengths: Array, elements: int) -> Array:
    """Elements of each of some stretches, by their lengths, one at least."""
    left = max(elements - len(lengths), 0)
    exact = left * lengths / lengths.sum()
    whole = np.floor(exact + 1e-9).astype(np.int64)
    most = np.argsort(whole - exact, kind="stable")[: left - int(whole.sum())]
    whole[most] += 1
    return whole + 1


def _single_nodes(layout: Layout) -> dict[str, Array]:
    """Places on beams that need a node: of a support, a tie, a mass or a spring."""
    found: dict[str, list[float]] = {}
    for name, at in layout.attached:
        found.setdefault(name, []).append(at)
    return {name: np.array(sorted(places)) for name, places in found.items()}


def _near(layout: Layout) -> float:
    """How near nodes may be to each other, m."""
    beams = [LIMITS.mesh_same * beam.length for beam in layout.beams]
    layers = [
        LIMITS.same_of_layer * (j.to - j.begin) / j.layer_elements
        for j in layout.joints
        if j.begin is not None and j.to
    ]
    return min([*beams, *layers], default=0.0)


def _facing(one: BeamPart, other: BeamPart, s: Array) -> Array:
    """Metres along another beam that lie across from `s` along one."""
    if one.name == other.name:
        return np.asarray(s, float)
    return np.asarray(one.facing(other, s))


def _merged(nodes: Array, more: Array, near: float) -> Array:
    """Sorted; of those that are one, the first list's stay, the earlier before the later."""
    kept = list(nodes)
    for s in more:
        if np.min(np.abs(np.array(kept) - s)) > near:
            kept.append(float(s))
    return np.sort(np.array(kept))
