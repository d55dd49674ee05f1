"""Quadratic drag on a velocity coordinate, f = c v |v|."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.joint.kinds import QUADRATIC_DRAG
from twin.joint.law import Series, Stiffness


@dataclass(frozen=True)
class QuadraticDrag:
    """f = c v |v|; over a velocity amplitude V its equivalent damping is 8 c V / (3 pi)."""

    kind: ClassVar[int] = QUADRATIC_DRAG
    states: ClassVar[int] = 0
    coefficient: float

    @property
    def parameters(self) -> Series:
        """[c]."""
        return np.array([self.coefficient])

    def path(self, e: Series) -> Series:
        """Force along a path of the velocity."""
        return self.coefficient * e * np.abs(e)

    def stiffness(self, amplitude: Series) -> Stiffness:
        """Force over velocity, real."""
        return np.asarray(8.0 / (3.0 * np.pi) * self.coefficient * np.asarray(amplitude, float), complex)
