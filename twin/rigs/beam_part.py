"""Beams as a rig file of format 2 describes them: plane beams, and beams in space."""

from __future__ import annotations

import math
from typing import Annotated, Literal, TypeVar

import numpy as np
from pydantic import Field, model_validator

from recordings.directions import Towards, Vector, cosine, unit_vector
from recordings.numbers import Density, Finite, Length, Modulus, NonNegative, Positive
from recordings.toml_input import Name, Table
from twin.arrays import Array
from twin.rigs.limits import LIMITS

Along = TypeVar("Along", float, Array)
"""One number of metres, or several."""
Point = Annotated[list[Finite], Field(min_length=2, max_length=3)]

IN_SPACE = ("second_moments", "torsion_constant", "poisson_ratio", "thickness_direction")
"""What a plane beam has no use for."""


class BeamSection(Table):
    """A rectangular beam's section and material."""

    width: Length
    """Out of the plane."""
    thickness: Length
    youngs_modulus: Modulus
    density: Density
    shear_ratio: NonNegative = 0.0
    """E / (kappa G) of a Timoshenko beam; 0 is Euler-Bernoulli."""

    @property
    def area(self) -> float:
        """Cross-section, m2."""
        return self.width * self.thickness

    @property
    def second_moment(self) -> float:
        """Second moment of area, m4."""
        return self.width * self.thickness**3 / 12.0


class BeamPart(BeamSection):
    """A straight beam on its neutral axis, of rectangular section unless area and second moments say otherwise.

    With two coordinates it is a plane beam, x, y and rz at a node; with three it is one in space, with all six.
    """

    name: Name
    kind: Literal["beam"]
    start: Point
    end: Point
    elements: Annotated[int, Field(ge=1, le=LIMITS.most_elements)] = 20
    """Of the whole beam, those of its joints' layers among them."""
    section_area: Positive | None = None
    """m2, of a section that is no rectangle; width and thickness are its outermost sizes then."""
    second_moments: tuple[Positive, Positive] | None = None
    """Of area, m4: for bending along the thickness and along the width."""
    torsion_constant: Positive | None = None
    """J, m4; left out, that of the rectangle."""
    poisson_ratio: Annotated[float, Field(gt=-1, lt=0.5)] = 0.3
    """For torsion: G = E / (2 (1 + poisson_ratio))."""
    thickness_direction: Towards | None = None
    """Where the thickness of a beam in space is measured; left out, across it and level, or +y of an upright beam."""

    @model_validator(mode="after")
    def _is_a_beam(self) -> BeamPart:
        if len(self.start) != len(self.end):
            raise ValueError("start and end need as many coordinates: two of a plane beam, three of one in space")
        if self.length <= 0:
            raise ValueError("start and end are the same point")
        if not self.in_space and (useless := [name for name in IN_SPACE if name in self.model_fields_set]):
            raise ValueError(f"{useless[0]} is of a beam in space: give start and end three coordinates")
        if self.second_moments and not self.section_area:
            raise ValueError("second_moments go with a section_area")
        if self.second_moments and not self.torsion_constant:
            raise ValueError("second_moments go with a torsion_constant, which the rectangle's is not")
        if self.thickness_direction and abs(cosine(self.thickness_direction, self.axis)) > LIMITS.beam_part_along:
            raise ValueError("thickness_direction lies along the beam; it must lie across")
        return self

    @property
    def in_space(self) -> bool:
        """Whether it moves in all six directions."""
        return len(self.start) == 3

    @property
    def area(self) -> float:
        """Cross-section, m2."""
        return self.section_area or super().area

    @property
    def second_moment(self) -> float:
        """Second moment of area for bending along the thickness, m4."""
        return self.second_moments[0] if self.second_moments else super().second_moment

    @property
    def second_moment_across(self) -> float:
        """The same for bending along the width, m4."""
        return self.second_moments[1] if self.second_moments else self.thickness * self.width**3 / 12.0

    @property
    def torsional_stiffness(self) -> float:
        """G J, N m2."""
        constant = self.torsion_constant or rectangle_torsion(self.width, self.thickness)
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio)) * constant

    @property
    def origin(self) -> Array:
        """The start in space, (3,), m."""
        return np.array([*self.start, 0.0][:3])

    @property
    def length(self) -> float:
        """Distance from start to end, m."""
        return math.dist(self.start, self.end)

    @property
    def axis(self) -> Vector:
        """Unit vector from start to end."""
        x, y, z = ([*((b - a) / self.length for a, b in zip(self.start, self.end, strict=True)), 0.0])[:3]
        return x, y, z

    @property
    def normal(self) -> Vector:
        """Unit vector along its thickness: to the left of a plane beam's axis, +y of a beam along +x."""
        x, y, z = self.axis
        if not self.in_space:
            return -y, x, 0.0
        if self.thickness_direction is None:
            level = math.hypot(x, y)
            return (-y / level, x / level, 0.0) if level > LIMITS.beam_part_upright else (0.0, 1.0, 0.0)
        wanted = unit_vector(self.thickness_direction)
        along = cosine(wanted, self.axis)
        across = [a - along * b for a, b in zip(wanted, (x, y, z), strict=True)]
        size = math.hypot(*across)
        return across[0] / size, across[1] / size, across[2] / size

    @property
    def ways_across(self) -> tuple[Vector, ...]:
        """Directions across it in which it bends: along its thickness, and in space along its width."""
        if not self.in_space:
            return (self.normal,)
        x, y, z = np.cross(self.axis, self.normal).tolist()
        return self.normal, (x, y, z)

    def facing(self, other: BeamPart, at: Along) -> Along:
        """Metres along another beam that lie across from `at` metres along this one."""
        ways = zip(self.origin, self.axis, other.origin, other.axis, strict=True)
        return sum(((a + at * u - b) * v for a, u, b, v in ways), start=0.0 * at)


def rectangle_torsion(width: float, thickness: float) -> float:
    """Torsion constant J of a rectangle, m4, by Saint-Venant's series (Timoshenko and Goodier, article 109)."""
    a, b = max(width, thickness), min(width, thickness)
    odd = np.arange(1, 40, 2)
    return float(a * b**3 * (1 / 3 - 64 / math.pi**5 * b / a * np.sum(np.tanh(odd * math.pi * a / (2 * b)) / odd**5)))
