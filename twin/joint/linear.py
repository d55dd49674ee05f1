"""The linear spring (or, on a velocity coordinate, the linear damper)."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.joint.kinds import LINEAR
from twin.joint.law import Series, Stiffness


@dataclass(frozen=True)
class Linear:
    """f = k e."""

    kind: ClassVar[int] = LINEAR
    states: ClassVar[int] = 0
    k: float

    @property
    def parameters(self) -> Series:
        """[k]."""
        return np.array([self.k])

    def path(self, e: Series) -> Series:
        """Force along a path."""
        return self.k * e

    def stiffness(self, amplitude: Series) -> Stiffness:
        """Equivalent stiffness, k at any amplitude."""
        return np.full(np.shape(amplitude), self.k + 0j)
