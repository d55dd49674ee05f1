"""A single uniform beam hung free, as in a hammer test of a specimen: M, K and their derivatives."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.structure.beam import beam_stiffness, deflection_shape
from twin.structure.timoshenko import timoshenko_mass, timoshenko_mass_derivative, timoshenko_stiffness_derivative

Matrix = NDArray[np.float64]
BENDING = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])


@dataclass(frozen=True)
class FreeBeam:
    """Bending matrices of a free beam, DOFs (v, theta) of each node, (2 (elements + 1),) squared.

    `M_shear` and `K_shear` are derivatives with respect to the shear ratio.
    """

    x: Matrix
    M: Matrix
    K: Matrix
    M_shear: Matrix
    K_shear: Matrix

    @property
    def transverse(self) -> NDArray[np.bool_]:
        """All of them: axial motion is left out."""
        return np.full(len(self.M), True)

    def deflection(self, position_m: float) -> Matrix:
        """Row c with v(position) = c x."""
        e = int(np.clip(np.searchsorted(self.x, position_m) - 1, 0, len(self.x) - 2))
        length = self.x[e + 1] - self.x[e]
        row = np.zeros(len(self.M))
        row[2 * e : 2 * e + 4] = deflection_shape((position_m - self.x[e]) / length, length)
        return row


def free_beam(
    *,
    length: float,
    width: float,
    thickness: float,
    youngs_modulus: float,
    density: float,
    shear_ratio: float,
    rotary: bool = True,
    elements: int = 60,
) -> FreeBeam:
    """Mesh a rectangular beam (SI); `shear_ratio` is E/(kappa G), `rotary` whether its sections' inertia counts."""
    area, radius2 = width * thickness, thickness**2 / 12
    EA = youngs_modulus * area
    piece = length / elements
    size = 2 * (elements + 1)
    total = np.zeros((4, size, size))
    section = {
        "mass_per_length": density * area,
        "radius2": radius2 if rotary else 0.0,
        "length": piece,
        "shear_ratio": shear_ratio,
    }
    parts = (
        timoshenko_mass(**section),
        beam_stiffness(EA=EA, EI=EA * radius2, length=piece, shear_ratio=shear_ratio),
        timoshenko_mass_derivative(**section),
        timoshenko_stiffness_derivative(EI=EA * radius2, radius2=radius2, length=piece, shear_ratio=shear_ratio),
    )
    for e in range(elements):
        at = slice(2 * e, 2 * e + 4)
        for target, part in zip(total, parts, strict=True):
            target[at, at] += part[BENDING]
    return FreeBeam(np.linspace(0.0, length, elements + 1), *total)
