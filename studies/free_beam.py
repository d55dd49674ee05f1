"""A single uniform beam hung free, as in a hammer test of a specimen."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from twin.structure.elements.beam import beam_mass, beam_stiffness, deflection_shape

Matrix = NDArray[np.float64]
BENDING = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])


@dataclass(frozen=True)
class FreeBeam:
    """Bending matrices of a free beam, DOFs (v, theta) of each node, (2 (elements + 1),) squared."""

    x: Matrix
    M: Matrix
    K: Matrix

    @property
    def transverse(self) -> NDArray[np.bool_]:
        """All of them: axial motion is left out."""
        return np.full(len(self.M), True)

    def row(self, position_m: float, shape: Callable[[float, float], Matrix] = deflection_shape) -> Matrix:
        """Row c with v(position) = c x, or with what another `shape` reads of an element."""
        e = int(np.clip(np.searchsorted(self.x, position_m) - 1, 0, len(self.x) - 2))
        length = float(self.x[e + 1] - self.x[e])
        row = np.zeros(len(self.M))
        row[2 * e : 2 * e + 4] = shape((position_m - self.x[e]) / length, length)
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
    mass = beam_mass(
        mass_per_length=density * area, radius2=radius2 if rotary else 0.0, length=piece, shear_ratio=shear_ratio
    )
    stiffness = beam_stiffness(EA=EA, EI=EA * radius2, length=piece, shear_ratio=shear_ratio)
    return FreeBeam(np.linspace(0.0, length, elements + 1), *(chained(part, elements) for part in (mass, stiffness)))


def chained(element: Matrix, count: int) -> Matrix:
    """Bending part of so many equal elements (6, 6) in a row."""
    total = np.zeros((2 * (count + 1), 2 * (count + 1)))
    for e in range(count):
        at = slice(2 * e, 2 * e + 4)
        total[at, at] += element[BENDING]
    return total
