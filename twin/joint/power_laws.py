"""Odd laws of one coefficient without memory: the linear and the cubic spring, and quadratic drag."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import CUBIC, LINEAR, QUADRATIC_DRAG


@dataclass(frozen=True)
class _OneCoefficient:
    coefficient: float
    states: ClassVar[int] = 0

    @property
    def parameters(self) -> Array:
        """[coefficient]."""
        return np.array([self.coefficient])


@dataclass(frozen=True)
class Linear(_OneCoefficient):
    """f = k e: a spring, or on a velocity coordinate a damper."""

    kind: ClassVar[int] = LINEAR

    def force_history(self, e: Array) -> Array:
        """Force along a path."""
        return self.coefficient * e

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness, k at any amplitude."""
        return np.full(np.shape(amplitude), self.coefficient + 0j)


@dataclass(frozen=True)
class Cubic(_OneCoefficient):
    """f = k e^3 with k in N/m3; describing function (3/4) k A^2."""

    kind: ClassVar[int] = CUBIC

    def force_history(self, e: Array) -> Array:
        """Force along a path."""
        return self.coefficient * e**3

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness."""
        return np.asarray(0.75 * self.coefficient * np.asarray(amplitude, float) ** 2, complex)


@dataclass(frozen=True)
class QuadraticDrag(_OneCoefficient):
    """``f = c v |v|`` of a velocity; over its amplitude V the equivalent damping is 8 c V / (3 pi)."""

    kind: ClassVar[int] = QUADRATIC_DRAG

    def force_history(self, e: Array) -> Array:
        """Force along a path of the velocity."""
        return self.coefficient * e * np.abs(e)

    def describing_function(self, amplitude: Array) -> Array:
        """Force over velocity, real."""
        return np.asarray(8.0 / (3.0 * np.pi) * self.coefficient * np.asarray(amplitude, float), complex)
