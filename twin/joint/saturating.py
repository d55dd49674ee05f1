"""A hyperelastic softening that saturates, f = k e / sqrt(1 + (e/e0)^2).

Its tangent k (1 + (e/e0)^2)^(-3/2) is positive everywhere, which no softening power law can say of itself: that makes
it the law for a layer whose equivalent modulus falls by two thirds.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from scipy.special import ellipe, ellipk

from twin.arrays import Array
from twin.joint.kinds import SATURATING
from twin.joint.law import Marched
from twin.joint.limits import LIMITS


@dataclass(frozen=True)
class Saturating(Marched):
    """f = k e / sqrt(1 + (e/e0)^2) + (spring) e.

    With k = -spring it is the softening part alone: nothing at small amplitudes, -k lost at large ones.  The describing
    function is ``spring + (4 k / (pi m)) (E(-m) - K(-m))`` with m = (A/e0)^2 and complete elliptic integrals.
    """

    kind: ClassVar[int] = SATURATING
    states: ClassVar[int] = 0
    k: float
    e0: float
    spring: float = 0.0

    @property
    def parameters(self) -> Array:
        """[k, e0, spring]."""
        return np.array([self.k, self.e0, self.spring])

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness."""
        m = (np.asarray(amplitude, float) / self.e0) ** 2
        series = 1.0 - 3.0 / 8.0 * m + 15.0 / 64.0 * m**2 - 175.0 / 1024.0 * m**3
        big = np.maximum(m, LIMITS.saturating_small)
        exact = 4.0 / (np.pi * big) * (ellipe(-big) - ellipk(-big))
        return np.asarray(self.k * np.where(m < LIMITS.saturating_small, series, exact) + self.spring, complex)
