"""What a picture of a structure needs: its parts in space, places on them, and how its joints open and slip."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import Delaunay

from recordings.directions import AXES
from twin.arrays import Array
from twin.rigs import Place
from twin.structure.elements.thin_layer import LayerRows
from twin.structure.limits import LIMITS
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure

FLAT = 1e-6
"""Spread of nodes across their longest axis, over that along it, below which they lie on a line."""


@dataclass(frozen=True, eq=False)
class LayerLine:
    """A joint's layer at `x` (k,) along it, m, and the rows (k, n) of its opening there and of its slip."""

    name: str
    x: Array
    opening: Array
    slip: Array


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """A part as a picture shows it."""

    name: str
    points: Array
    """Coordinates of its nodes, m, (k, 3)."""
    edges: Array
    """Which of them are joined by a line, (e, 2)."""
    rows: Array
    """Their displacements along x, y and z, (3, k, n)."""


def drawn_parts(structure: Structure) -> tuple[DrawnPart, ...]:
    """Every part: a beam as its line, a part given by matrices as a net of its nodes."""
    parts = []
    for mesh in structure.meshes.values():
        name = mesh.part.name
        if isinstance(mesh, BeamMesh):
            points = mesh.coordinates(mesh.s)
            nodes = list(mesh.s)
            edges = np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
        else:
            points, nodes = mesh.matrices.coordinates, list(mesh.matrices.nodes)
            edges = _net(points)
        rows = np.array([
            [structure.row(Place(name, float(node), axis)) for node in nodes] for axis in AXES.values()
        ])  # fmt: skip
        parts.append(DrawnPart(name, points, edges, rows))
    return tuple(parts)


def point_of(structure: Structure, place: Place) -> Array:
    """Coordinates (3,) of a place, m."""
    return structure.meshes[place.part].coordinates(place.at)


def _net(points: Array) -> Array:
    """Pairs of neighbours as seen on the plane in which the nodes spread most; a chain where they lie on a line.

    Matrices come without elements: this is a net to look at, and no more.
    """
    away = points - points.mean(axis=0)
    _, spread, axes = np.linalg.svd(away, full_matrices=False)
    if len(points) < 4 or spread[1] < FLAT * spread[0]:
        order = np.argsort(away @ axes[0])
        return np.column_stack([order[:-1], order[1:]])
    corners = Delaunay(away @ axes[:2].T).simplices
    sides = np.vstack([corners[:, [0, 1]], corners[:, [1, 2]], corners[:, [0, 2]]])
    return np.unique(np.sort(sides, axis=1), axis=0).astype(np.int64)


def drawn_places(structure: Structure, places: Sequence[Place], *, name: str) -> DrawnPart:
    """Places as the points of one part without lines."""
    points = np.array([point_of(structure, place) for place in places]).reshape(-1, 3)
    rows = [[structure.row(place.towards(axis)) for place in places] for axis in AXES.values()]
    return DrawnPart(name, points, np.zeros((0, 2), np.int64), np.reshape(rows, (3, len(places), len(structure.M))))


def layer_lines(structure: Structure) -> tuple[LayerLine, ...]:
    """Every joint's layer; of one that slips in two directions the slip along it."""
    lines = []
    for joint in structure.joints:
        x, opening = _means(joint.normal)
        at, slip = _means(joint.shear.chosen(joint.shear.direction == joint.shear.direction.min()))
        there = np.array([np.interp(x, at, column) for column in slip.T]).T
        lines.append(LayerLine(joint.name, x, opening, there))
    return tuple(lines)


def _means(rows: LayerRows) -> tuple[Array, Array]:
    """Places (k,) in rising order, and the mean of the rows at each, in metres, (k, n)."""
    cells, inverse, count = np.unique(
        np.round(rows.at / LIMITS.drawn_nearest_m), return_inverse=True, return_counts=True
    )
    total = np.zeros((len(cells), rows.B.shape[1]))
    np.add.at(total, inverse, rows.metres)
    return LIMITS.drawn_nearest_m * cells, total / count[:, None]
