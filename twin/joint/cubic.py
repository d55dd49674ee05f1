"""The cubic spring, f = k e^3."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.joint.kinds import CUBIC
from twin.joint.law import Series, Stiffness


@dataclass(frozen=True)
class Cubic:
    """f = stiffness_N_per_m3 e^3, with describing function (3/4) k A^2."""

    kind: ClassVar[int] = CUBIC
    states: ClassVar[int] = 0
    stiffness_N_per_m3: float

    @property
    def parameters(self) -> Series:
        """[k]."""
        return np.array([self.stiffness_N_per_m3])

    def path(self, e: Series) -> Series:
        """Force along a path."""
        return self.stiffness_N_per_m3 * e**3

    def stiffness(self, amplitude: Series) -> Stiffness:
        """Equivalent stiffness."""
        return np.asarray(0.75 * self.stiffness_N_per_m3 * np.asarray(amplitude, float) ** 2, complex)
