"""What a picture of a structure needs: its parts in space, and its beams laid out along one axis."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import Delaunay

from twin.rigs import BeamPart, Layout, Place
from twin.rigs.layout import DIRECTIONS
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure

__all__ = ["BeamLine", "DrawnPart", "beam_lines", "drawn_parts", "drawn_position", "point_of"]

Array = NDArray[np.float64]

FLAT = 1e-6
"""Spread of nodes across their longest axis, over that along it, below which they lie on a line."""
PARALLEL = 1e-6
"""Sine of the angle between beams up to which they are drawn where they lie."""


@dataclass(frozen=True, eq=False)
class BeamLine:
    """A beam's nodes at `x` (k,) on the drawing's axis, m, and the rows (k, n) of their deflections across it."""

    name: str
    x: Array
    rows: Array


@dataclass(frozen=True, eq=False)
class DrawnPart:
    """A part as a picture shows it.

    Attributes
    ----------
    points : ndarray, (k, 3)
        Coordinates of its nodes, m.
    edges : ndarray of int, (e, 2)
        Which of them are joined by a line.
    rows : ndarray, (3, k, n)
        Their displacements along x, y and z.
    """

    name: str
    points: Array
    edges: NDArray[np.int64]
    rows: Array


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
            [structure.row(Place(name, float(node), axis)) for node in nodes] for axis in DIRECTIONS.values()
        ])  # fmt: skip
        parts.append(DrawnPart(name, points, edges, rows))
    return tuple(parts)


def point_of(structure: Structure, place: Place) -> Array:
    """Coordinates (3,) of a place, m."""
    return structure.meshes[place.part].coordinates(place.at)


def _net(points: Array) -> NDArray[np.int64]:
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


def beam_lines(structure: Structure) -> tuple[BeamLine, ...]:
    """Every beam of a structure."""
    lines = []
    for mesh in structure.meshes.values():
        if isinstance(mesh, BeamMesh):
            normal = (*mesh.part.normal, 0.0)
            places = [Place(mesh.part.name, float(s), normal) for s in mesh.s]
            x = np.array([drawn_position(structure.layout, place) for place in places])
            lines.append(BeamLine(mesh.part.name, x, np.array([structure.row(place) for place in places])))
    return tuple(lines)


def drawn_position(layout: Layout, place: Place) -> float | None:
    """Where a place is drawn, m: along the first beam where all are parallel, else along one after the other.

    None for a place on no beam.
    """
    beams = {beam.name: beam for beam in layout.beams}
    if place.part not in beams:
        return None
    first = layout.beams[0]
    if all(abs(_sine(first, beam)) < PARALLEL for beam in layout.beams):
        beam = beams[place.part]
        return float(np.dot(np.array(beam.start) + place.at * np.array(beam.axis) - np.array(first.start), first.axis))
    before = 0.0
    for name, beam in beams.items():
        if name == place.part:
            return before + place.at
        before += beam.length
    return None


def _sine(one: BeamPart, two: BeamPart) -> float:
    return one.axis[0] * two.axis[1] - one.axis[1] * two.axis[0]
