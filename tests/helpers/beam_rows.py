"""Rows of a beam's motions that only tests ask for, so many metres along a structure."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.structure import Structure
from twin.structure.elements.beam import deflection_shape
from twin.structure.mesh import BeamMesh

__all__ = ["axial", "curvature", "deflection", "slope"]

Row = NDArray[np.float64]


def deflection(structure: Structure, position_m: float) -> Row:
    """Row with v(position), the displacement across the beam that lies there."""
    return structure.row(structure.layout.place(position_m))


def axial(structure: Structure, position_m: float) -> Row:
    """Row with u(position), the displacement along the beam that lies there."""
    place = structure.layout.place(position_m)
    return structure.row(place.towards(structure.layout.beam(place.part).axis))


def slope(structure: Structure, position_m: float) -> Row:
    """Row with v'(position), the derivative of the displacement across it."""
    mesh, at = _mesh(structure, position_m)
    return _over(structure, mesh.slope(at))


def curvature(structure: Structure, position_m: float) -> Row:
    """Row with v''(position)."""
    mesh, at = _mesh(structure, position_m)
    return _over(
        structure, mesh._row(at, lambda xi, length: (np.zeros(2), deflection_shape(xi, length, 2), np.zeros(4)))
    )


def _mesh(structure: Structure, position_m: float) -> tuple[BeamMesh, float]:
    place = structure.layout.place(position_m)
    mesh = structure.meshes[place.part]
    assert isinstance(mesh, BeamMesh)
    return mesh, place.at


def _over(structure: Structure, found: tuple[NDArray[np.int64], Row]) -> Row:
    dofs, coefficients = found
    return np.asarray(coefficients @ structure.basis[dofs])
