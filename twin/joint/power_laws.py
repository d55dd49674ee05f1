"""Odd laws of one coefficient without memory: the linear and the cubic spring, and quadratic drag."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import CUBIC, LINEAR, QUADRATIC_DRAG
from twin.joint.law import Marched
from twin.joint.polynomial import storage_ratio


@dataclass(frozen=True)
class _OneCoefficient(Marched):
    """f = coefficient |e|^power e."""

    coefficient: float
    states: ClassVar[int] = 0
    power: ClassVar[int]

    @property
    def parameters(self) -> Array:
        """[coefficient]."""
        return np.array([self.coefficient])

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness; of a velocity, equivalent damping."""
        A = np.asarray(amplitude, float)
        return np.asarray(storage_ratio(self.power) * self.coefficient * A**self.power, complex)


@dataclass(frozen=True)
class Linear(_OneCoefficient):
    """f = k e: a spring, or on a velocity coordinate a damper."""

    kind: ClassVar[int] = LINEAR
    power: ClassVar[int] = 0


@dataclass(frozen=True)
class Cubic(_OneCoefficient):
    """f = k e^3 with k in N/m3; describing function (3/4) k A^2."""

    kind: ClassVar[int] = CUBIC
    power: ClassVar[int] = 2


@dataclass(frozen=True)
class QuadraticDrag(_OneCoefficient):
    """``f = c v |v|`` of a velocity; over its amplitude V the equivalent damping is 8 c V / (3 pi)."""

    kind: ClassVar[int] = QUADRATIC_DRAG
    power: ClassVar[int] = 1
