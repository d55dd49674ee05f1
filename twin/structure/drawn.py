"""Beams laid out along one axis, to draw their deflections over it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.rigs import BeamPart, Layout, Place
from twin.structure.mesh import BeamMesh
from twin.structure.structure import Structure

__all__ = ["BeamLine", "beam_lines", "drawn_position"]

Array = NDArray[np.float64]

PARALLEL = 1e-6
"""Sine of the angle between beams up to which they are drawn where they lie."""


@dataclass(frozen=True, eq=False)
class BeamLine:
    """A beam's nodes at `x` (k,) on the drawing's axis, m, and the rows (k, n) of their deflections across it."""

    name: str
    x: Array
    rows: Array


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
