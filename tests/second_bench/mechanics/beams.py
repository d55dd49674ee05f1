"""Straight Euler-Bernoulli beams in a plane: cubic deflection, linear stretch, consistent mass."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

DOFS = 3
"""Of a node: u along the beam, v across it, theta."""


@dataclass(frozen=True)
class Beam:
    """A prismatic beam along x.

    Attributes
    ----------
    start, length, width, thickness
        m; `start` is where it begins along the structure.
    modulus
        Young's, N/m2.
    density
        kg/m3.
    """

    start: float
    length: float
    width: float
    thickness: float
    modulus: float
    density: float

    @property
    def area(self) -> float:
        """Of the section, m2."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Of the section, m4."""
        return self.width * self.thickness**3 / 12


@dataclass(frozen=True)
class WeakStretch:
    """A stretch of a beam that has kept a `factor` of its stiffness; `begin` and `end` in m along the structure."""

    begin: float
    end: float
    factor: float


@dataclass(frozen=True, eq=False)
class MeshedBeam:
    """A beam with nodes at `x` (m along the structure), rising, and a factor on the stiffness of each element."""

    beam: Beam
    x: Array
    factor: Array

    @property
    def size(self) -> int:
        """Number of degrees of freedom."""
        return DOFS * len(self.x)

    def matrices(self) -> tuple[Array, Array]:
        """Mass and stiffness, (size, size) each."""
        beam = self.beam
        M, K = np.zeros((self.size, self.size)), np.zeros((self.size, self.size))
        for first, (length, factor) in enumerate(zip(np.diff(self.x), self.factor, strict=True)):
            here = slice(DOFS * first, DOFS * (first + 2))
            M[here, here] += _mass(beam.density * beam.area, length)
            K[here, here] += factor * _stiffness(
                EA=beam.modulus * beam.area, EI=beam.modulus * beam.second_moment, length=length
            )
        return M, K

    def rows(self, x: float) -> tuple[Array, Array, Array]:
        """Rows whose products with the displacements are u, v and the slope v' at `x`, (size,) each."""
        first = int(np.clip(np.searchsorted(self.x, x, side="right") - 1, 0, len(self.x) - 2))
        length = self.x[first + 1] - self.x[first]
        s = (x - self.x[first]) / length
        u, v, slope = np.zeros(self.size), np.zeros(self.size), np.zeros(self.size)
        start = DOFS * first
        u[[start, start + 3]] = 1 - s, s
        bending = [start + 1, start + 2, start + 4, start + 5]
        v[bending] = (
            1 - 3 * s**2 + 2 * s**3, length * (s - 2 * s**2 + s**3), 3 * s**2 - 2 * s**3, length * (s**3 - s**2),
        )  # fmt: skip
        slope[bending] = 6 * (s**2 - s) / length, 1 - 4 * s + 3 * s**2, 6 * (s - s**2) / length, 3 * s**2 - 2 * s
        return u, v, slope


def meshed(beam: Beam, elements: int, weak: tuple[WeakStretch, ...] = ()) -> MeshedBeam:
    """Equal elements, divided where a weak stretch begins or ends."""
    end = beam.start + beam.length
    edges = [edge for stretch in weak for edge in (stretch.begin, stretch.end) if beam.start < edge < end]
    x = np.unique([*np.linspace(beam.start, end, elements + 1), *edges])
    middle = (x[:-1] + x[1:]) / 2
    factor = np.ones(len(middle))
    for stretch in weak:
        factor[(middle > stretch.begin) & (middle < stretch.end)] *= stretch.factor
    return MeshedBeam(beam, x, factor)


def _stiffness(*, EA: float, EI: float, length: float) -> Array:
    L, K = length, np.zeros((6, 6))
    K[np.ix_([0, 3], [0, 3])] = EA / L * np.array([[1, -1], [-1, 1]])
    K[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = (EI / L**3) * np.array([
        [12, 6 * L, -12, 6 * L],
        [6 * L, 4 * L**2, -6 * L, 2 * L**2],
        [-12, -6 * L, 12, -6 * L],
        [6 * L, 2 * L**2, -6 * L, 4 * L**2],
    ])  # fmt: skip
    return K


def _mass(per_length: float, length: float) -> Array:
    L, M = length, np.zeros((6, 6))
    M[np.ix_([0, 3], [0, 3])] = per_length * L / 6 * np.array([[2, 1], [1, 2]])
    M[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = (per_length * L / 420) * np.array([
        [156, 22 * L, 54, -13 * L],
        [22 * L, 4 * L**2, 13 * L, -3 * L**2],
        [54, 13 * L, 156, -22 * L],
        [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
    ])  # fmt: skip
    return M
