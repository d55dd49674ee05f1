"""Jenkins elements, springs in series with Coulomb sliders, one or many in parallel as in Iwan and Masing laws."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import SLIDERS
from twin.joint.law import Marched


def jenkins_stiffness(amplitude: Array | float, stiffness_N_per_m: float, slip_force_N: float) -> Array:
    """Describing function.

    The element sticks up to A = F/k; beyond, with cos b = 1 - 2 F/(k A),
    ``(k/pi) (b - sin(2 b)/2) + j (4 F/(pi A)) (1 - F/(k A))``.
    """
    k = stiffness_N_per_m
    r = np.minimum(slip_force_N / (k * np.asarray(amplitude, float)), 1.0)
    b = np.arccos(1.0 - 2.0 * r)
    return np.asarray(k / np.pi * (b - np.sin(2 * b) / 2) + 4j * k / np.pi * r * (1 - r), complex)


@dataclass(frozen=True)
class ParallelJenkins(Marched):
    """Springs in series with Coulomb sliders, all in parallel; the state is the force in each.

    Iwan and Masing laws are such networks; see their files for how they are made, and for their closed forms.
    """

    kind: ClassVar[int] = SLIDERS
    stiffness_N_per_m: tuple[float, ...]
    slip_force_N: tuple[float, ...]

    @property
    def states(self) -> int:
        """The last coordinate, and one force a slider."""
        return 1 + len(self.slip_force_N)

    @property
    def parameters(self) -> Array:
        """[n, k1, F1, k2, F2, ...]."""
        rows = zip(self.stiffness_N_per_m, self.slip_force_N, strict=True)
        return np.array([len(self.slip_force_N), *(value for row in rows for value in row)], float)

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness, the sum of the elements'."""
        pairs = zip(self.stiffness_N_per_m, self.slip_force_N, strict=True)
        return np.asarray(sum(jenkins_stiffness(amplitude, k, F) for k, F in pairs))


def jenkins(stiffness_N_per_m: float, slip_force_N: float) -> ParallelJenkins:
    """A network of one."""
    return ParallelJenkins((stiffness_N_per_m,), (slip_force_N,))
