"""What everything else asks of a structure: mass, stiffness, what its joints do, and rows of places.

Nothing outside this package knows of parts, nodes or degrees of freedom.  Stiffness is linear in the joints' moduli,
K = K0 + sum E'_j KE_j + G'_j KG_j, and the joints' parts are of low rank.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from recordings.directions import AXES
from twin.arrays import Array
from twin.rigs import Layout, Place
from twin.structure.elements.thin_layer import LayerRows
from twin.structure.limits import LIMITS
from twin.structure.matrix_coordinates import MatrixCoordinates
from twin.structure.mesh import BeamMesh
from twin.structure.node_field import NodeField

Mesh = BeamMesh | MatrixCoordinates


@dataclass(frozen=True, eq=False)
class JointOperators:
    """Strain operators of a joint's layer."""

    name: str
    normal: LayerRows
    shear: LayerRows
    """Openings and slips over the structure's coordinates, m along the joint."""
    ends: tuple[float, float]
    """Where the layer begins and ends on that scale."""
    points: Array
    """Coordinates of the normal points, m, (r, 3)."""

    @property
    def B_E(self) -> Array:
        """KE = B_E' B_E, (r, n)."""
        return self.normal.B

    @property
    def B_G(self) -> Array:
        """KG = B_G' B_G, (q, n)."""
        return self.shear.B

    @property
    def KE(self) -> Array:
        """Stiffness of the layer per unit of E'."""
        return self.B_E.T @ self.B_E

    @property
    def KG(self) -> Array:
        """Stiffness of the layer per unit of G'."""
        return self.B_G.T @ self.B_G

    @property
    def sparse(self) -> tuple[csr_array, csr_array]:
        """Both, sparse."""
        normal, shear = csr_array(self.B_E), csr_array(self.B_G)
        return csr_array(normal.T @ normal), csr_array(shear.T @ shear)

    def over(self, basis: Array | csr_array) -> JointOperators:
        """The same over other coordinates, x = basis z."""
        normal, shear = (replace(rows, B=rows.B @ basis) for rows in (self.normal, self.shear))
        return replace(self, normal=normal, shear=shear)

    def with_gradient(self, gradient: float) -> JointOperators:
        """The same with moduli that vary along the layer as 1 - gradient (xi - 1/2), xi = 0 ... 1."""
        start, end = self.ends
        normal, shear = (
            rows.scaled(np.sqrt(np.maximum(1 - gradient * ((rows.at - start) / (end - start) - 0.5), 1e-6)))
            for rows in (self.normal, self.shear)
        )
        return replace(self, normal=normal, shear=shear)


@dataclass(frozen=True, eq=False)
class Structure:
    """A structure in n coordinates."""

    sparse_M: csr_array
    sparse_K0: csr_array
    """Mass with the sensors' masses, and stiffness of the parts and supports without the joints, (n, n)."""
    B_C: Array
    """Rows of the viscous dampers between places, C = B_C' B_C, (d, n); modal damping comes beside them."""
    joints: tuple[JointOperators, ...]
    """In the rig file's order."""
    layout: Layout
    """What it was made of."""
    meshes: dict[str, Mesh]
    """Beams and parts given by matrices, by name, over all displacements."""
    sparse_basis: csr_array
    """All displacements of the parts from the coordinates, (N, n)."""
    free: Array
    """Which of the displacements the coordinates are, (n,)."""

    @property
    def size(self) -> int:
        """Number n of coordinates."""
        return int(self.sparse_M.shape[0])

    @cached_property
    def M(self) -> Array:
        """Mass, dense."""
        return np.asarray(self.sparse_M.toarray())

    @cached_property
    def K0(self) -> Array:
        """Stiffness without the joints, dense."""
        return np.asarray(self.sparse_K0.toarray())

    @cached_property
    def basis(self) -> Array:
        """All displacements from the coordinates, dense."""
        return np.asarray(self.sparse_basis.toarray())

    @property
    def reductions(self) -> tuple[MatrixCoordinates, ...]:
        """The parts that were reduced when they were loaded."""
        return tuple(mesh for mesh in self.meshes.values() if isinstance(mesh, MatrixCoordinates))

    def stiffness(self, E: float | Sequence[float] | Array, G: float | Sequence[float] | Array) -> Array:
        """K at moduli E', G' in N/m2: one for each joint, or one for all."""
        K = self.K0
        for joint, e, g in zip(
            self.joints, np.broadcast_to(E, len(self.joints)), np.broadcast_to(G, len(self.joints)), strict=True
        ):
            K = K + e * joint.KE + g * joint.KG
        return K

    def row(self, place: Place) -> Array:
        """Row c (n,) with c x what is read at a place: the displacement in its direction, or the strain of its surface.

        ValueError if the place is not on the structure.
        """
        if place.reads == "strain":
            return self._strain(place)
        return self._translation(place, place.direction)

    def translations(self, place: Place) -> Array:
        """Rows (k, n) of the displacement there: along x and y of a plane beam, along z too of any other part."""
        mesh = self.meshes[place.part]
        plane = isinstance(mesh, BeamMesh) and not mesh.part.in_space
        return np.array([self._translation(place, axis) for name, axis in AXES.items() if name != "z" or not plane])

    def _translation(self, place: Place, direction: Sequence[float]) -> Array:
        mesh = self.meshes[place.part]
        shares = place.between or ((place.at, 1.0),)
        return sum((share * self._over(*mesh.translation(at, direction)) for at, share in shares), np.zeros(self.size))

    def motion(self, place: Place, dof: str) -> Array:
        """Row of one motion at a place: along an axis, or a rotation about one.

        ValueError if the place does not move so, or has no rotation that is known: of beams, plane ones have.
        """
        if dof in AXES:
            return self._translation(place, AXES[dof])
        mesh = self.meshes[place.part]
        if isinstance(mesh, MatrixCoordinates):
            found = mesh.dof(place.at, dof)
        else:
            found = mesh.slope(place.at) if dof == "rz" and not mesh.part.in_space else None
        if found is None:
            raise ValueError(f"{place.part!r} at {place.at:g} has no rotation {dof}")
        return self._over(*found)

    def node_field(self, part: str) -> NodeField:
        """The nodes of a part given by matrices, to search a place among them."""
        mesh = self.meshes[part]
        assert isinstance(mesh, MatrixCoordinates)
        return mesh.field

    def surface_motion(self, place: Place, *, side: int) -> Array:
        """Row of the motion along a beam at its surface, half a thickness off the axis: +1 the left one, -1 the right.

        Of a part given by matrices there is no such surface: no motion.
        """
        mesh = self.meshes[place.part]
        if not isinstance(mesh, BeamMesh):
            return np.zeros(self.size)
        along = self.row(place.towards(mesh.part.axis))
        return along - side * mesh.part.thickness / 2 * self._over(*mesh.slope(place.at))

    def _strain(self, place: Place) -> Array:
        """Row of the strain along a beam at the surface that faces in the place's direction, m/m.

        It is u' - s (h/2) v'', s = 1 for the left surface and -1 for the right one; with transverse shear the curvature
        is that of the section's rotation.
        """
        mesh = self.meshes[place.part]
        assert isinstance(mesh, BeamMesh)
        side = 1.0 if float(np.dot(place.direction, mesh.part.normal)) > 0 else -1.0
        return self._over(*mesh.strain(place.at, side=side))

    def rigid_translation(self, direction: tuple[float, float, float]) -> Array:
        """Coordinates (n,) of a unit translation of everything that is not held."""
        whole = np.zeros(self.sparse_basis.shape[0])
        for mesh in self.meshes.values():
            whole[mesh.first : mesh.first + mesh.size] = mesh.rigid_translation(direction)
        return whole[self.free]

    @property
    def counted(self) -> Array:
        """Coordinates that have most of a mode that counts: those across where all beams lie in one row, else all."""
        beams = self.layout.beams
        row = len(beams) == len(self.layout.parts) and all(abs(beam.axis[0]) > LIMITS.in_a_row for beam in beams)
        along = np.zeros(self.sparse_basis.shape[0], bool)
        for mesh in self.meshes.values():
            if isinstance(mesh, BeamMesh):
                along[mesh.first : mesh.first + mesh.size : len(mesh.dofs)] = row
        return np.asarray(~along[self.free])

    def with_gradient(self, gradient: float, *, joint: int = 0) -> Structure:
        """The same structure with a joint whose moduli vary along it, see :meth:`JointOperators.with_gradient`."""
        joints = tuple(j.with_gradient(gradient) if n == joint else j for n, j in enumerate(self.joints))
        return replace(self, joints=joints)

    def _over(self, dofs: Array, coefficients: Array) -> Array:
        return np.asarray(coefficients @ self.sparse_basis[dofs])
