"""The assembled structure: M, K0 and the layer's low-rank strain operators, K = K0 + E' KE + G' KG."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from twin.rigs import Rig
from twin.structure.beam import beam_mass, beam_stiffness, curvature_shape, deflection_shape, slope_shape
from twin.structure.gauss import gauss
from twin.structure.mesh import LapJointMesh, mesh_rig
from twin.structure.thin_layer import thin_layer
from twin.structure.timoshenko import timoshenko_mass

__all__ = ["Structure", "add_chain", "assemble"]

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Structure:
    """A structure in its free degrees of freedom (n of them).

    Attributes
    ----------
    M, K0 : ndarray, (n, n)
        Mass with the sensors' masses, and stiffness of the beams without the layer.
    B_E, B_G : ndarray, (r, n)
        Strain operators of the layer's Gauss points, KE = B_E' B_E and KG = B_G' B_G.
    normal_weight, shear_weight : ndarray, (r,)
        B_E / normal_weight is the opening in metres, B_G / shear_weight the slip.
    layer_x, shear_x : ndarray
        Positions of the normal and the shear Gauss points, m.
    free : ndarray of int
        The free ones among all 3 x nodes degrees of freedom.
    """

    mesh: LapJointMesh
    M: Matrix
    K0: Matrix
    B_E: Matrix
    B_G: Matrix
    normal_weight: Matrix
    shear_weight: Matrix
    layer_x: Matrix
    shear_x: Matrix
    free: NDArray[np.int64]

    @property
    def KE(self) -> Matrix:
        """Stiffness of the layer per unit of E'."""
        return self.B_E.T @ self.B_E

    @property
    def KG(self) -> Matrix:
        """Stiffness of the layer per unit of G'."""
        return self.B_G.T @ self.B_G

    def stiffness(self, E: float, G: float) -> Matrix:
        """K at layer moduli E', G' in N/m2."""
        return self.K0 + E * self.KE + G * self.KG

    def deflection(self, position_m: float) -> Matrix:
        """Row c with v(position) = c x.  Within the overlap it is the lower beam's deflection."""
        return self._row(position_m, deflection_shape, [1, 2, 4, 5])

    def slope(self, position_m: float) -> Matrix:
        """Row with v'(position), the derivative of :meth:`deflection` with respect to position."""
        return self._row(position_m, slope_shape, [1, 2, 4, 5])

    def curvature(self, position_m: float) -> Matrix:
        """Row with v''(position), the beam's curvature."""
        return self._row(position_m, curvature_shape, [1, 2, 4, 5])

    def axial(self, position_m: float) -> Matrix:
        """Row with u(position)."""
        return self._row(position_m, lambda xi, _length: np.array([1 - xi, xi]), [0, 3])

    def with_point_mass(self, position_m: float, mass_kg: float) -> Structure:
        """The same structure with a mass fixed at `position_m`."""
        v, u = self.deflection(position_m), self.axial(position_m)
        return replace(self, M=self.M + mass_kg * (np.outer(v, v) + np.outer(u, u)))

    def with_lateral_spring(self, position_m: float, stiffness_N_per_m: float, *, thickness_m: float) -> Structure:
        """The same structure on a spring to ground along the beam, at its bottom surface, which resists slope too."""
        row = self.axial(position_m) + thickness_m / 2 * self.slope(position_m)
        return replace(self, K0=self.K0 + stiffness_N_per_m * np.outer(row, row))

    def with_layer_gradient(self, gradient: float) -> Structure:
        """The same structure with layer moduli that vary along the overlap as 1 - gradient (xi - 1/2), xi = 0 ... 1."""
        start, end = self.layer_ends
        normal, shear = (
            np.sqrt(np.maximum(1 - gradient * ((x - start) / (end - start) - 0.5), 1e-6))
            for x in (self.layer_x, self.shear_x)
        )
        return replace(
            self,
            B_E=normal[:, None] * self.B_E,
            B_G=shear[:, None] * self.B_G,
            normal_weight=normal * self.normal_weight,
            shear_weight=shear * self.shear_weight,
        )

    @property
    def layer_ends(self) -> tuple[float, float]:
        """Where the layer begins and ends, m from the clamp."""
        first, last = (self.mesh.lower_x[self.mesh.layer_nodes[i][0]] for i in (0, -1))
        return float(first), float(last)

    def _row(self, position_m: float, shape: Callable[[float, float], Matrix], local: list[int]) -> Matrix:
        lower = position_m <= self.mesh.lower_x[-1]
        x = self.mesh.lower_x if lower else self.mesh.upper_x
        offset = 0 if lower else len(self.mesh.lower_x)
        if not x[0] - 1e-9 <= position_m <= x[-1] + 1e-9:
            raise ValueError(f"position {position_m} m is not on the structure")
        e = int(np.clip(np.searchsorted(x, position_m) - 1, 0, len(x) - 2))
        length = x[e + 1] - x[e]
        row = np.zeros(3 * self.mesh.nodes)
        dofs = 3 * (offset + e) + np.array(local)
        row[dofs] = shape((position_m - x[e]) / length, length)
        return row[self.free]


def assemble(
    rig: Rig,
    *,
    mesh: LapJointMesh | None = None,
    clamped: bool = True,
    sensor_masses: bool = True,
    clamp_rotation_stiffness: float | None = None,
) -> Structure:
    """Assemble the two beams and the layer of `rig`.

    Parameters
    ----------
    mesh
        Other than the rig file's own.
    clamped
        Whether the lower beam is fixed at x = 0; otherwise the structure floats.
    sensor_masses
        Whether the sensors' masses are in M.
    clamp_rotation_stiffness
        Of a clamp that lets the beam's root turn, N m/rad; None is a rigid clamp.
    """
    mesh = mesh or mesh_rig(rig)
    size = 3 * mesh.nodes
    M, K0 = np.zeros((size, size)), np.zeros((size, size))
    for beam, x, offset in ((rig.lower, mesh.lower_x, 0), (rig.upper, mesh.upper_x, len(mesh.lower_x))):
        E, A, I, rho = beam.youngs_modulus, beam.area, beam.second_moment, beam.density
        length = np.diff(x)
        add_chain(K0, offset, beam_stiffness(EA=E * A, EI=E * I, length=length, shear_ratio=beam.shear_ratio))
        if beam.shear_ratio > 0:
            section = {"mass_per_length": rho * A, "radius2": I / A, "shear_ratio": beam.shear_ratio}
            add_chain(M, offset, timoshenko_mass(**section, length=length))
        else:
            add_chain(M, offset, beam_mass(mass_per_length=rho * A, length=length))
    held = 3 if clamped else 0
    if clamped and clamp_rotation_stiffness is not None:
        held = 2
        K0[2, 2] += clamp_rotation_stiffness
    free = np.arange(held, size)
    structure = Structure(mesh, M[np.ix_(free, free)], K0[np.ix_(free, free)], *_layer(rig, mesh, free), free=free)
    if sensor_masses:
        for sensor in rig.sensor:
            structure = structure.with_point_mass(sensor.position, sensor.mass)
    if rig.drive.stinger_lateral_stiffness:
        structure = structure.with_lateral_spring(
            rig.force_sensor.position, rig.drive.stinger_lateral_stiffness, thickness_m=rig.lower.thickness
        )
    return structure


def add_chain(whole: Matrix, first: int, elements: Matrix) -> None:
    """Add the matrices (e, 6, 6) of elements from node to node, beginning at node `first`."""
    dofs = 3 * (first + np.arange(len(elements)))[:, None] + np.arange(6)
    # Every other element shares no node with the next, so that each turn adds to an entry once.
    for turn in (slice(0, None, 2), slice(1, None, 2)):
        whole[dofs[turn, :, None], dofs[turn, None, :]] += elements[turn]


def _layer(
    rig: Rig, mesh: LapJointMesh, free: NDArray[np.int64]
) -> tuple[Matrix, Matrix, Matrix, Matrix, Matrix, Matrix]:
    """Strain operators of all layer elements, their weights and the positions of their Gauss points."""
    normal: list[Matrix] = []
    shear: list[Matrix] = []
    normal_weight, shear_weight = [], []
    normal_x: list[Matrix] = []
    shear_x: list[Matrix] = []
    width = min(rig.lower.width, rig.upper.width)
    for (low, up), (low2, _up2) in zip(mesh.layer_nodes, mesh.layer_nodes[1:], strict=False):
        length = mesh.lower_x[low2] - mesh.lower_x[low]
        element = thin_layer(
            length=length,
            height=rig.joint.layer_height,
            width=width,
            bottom_thickness=rig.lower.thickness,
            top_thickness=rig.upper.thickness,
        )
        dofs = np.concatenate([3 * low + np.arange(6), 3 * up + np.arange(6)])
        for B, rows in ((element.B_E, normal), (element.B_G, shear)):
            full = np.zeros((len(B), 3 * mesh.nodes))
            full[:, dofs] = B
            rows.append(full[:, free])
        normal_weight.append(element.normal_weight)
        shear_weight.append(element.shear_weight)
        for B, positions in ((element.B_E, normal_x), (element.B_G, shear_x)):
            positions.append(mesh.lower_x[low] + length * gauss(len(B))[0])
    return (
        np.vstack(normal),
        np.vstack(shear),
        np.concatenate(normal_weight),
        np.concatenate(shear_weight),
        np.concatenate(normal_x),
        np.concatenate(shear_x),
    )
