"""Jenkins elements in parallel: the time form of Iwan and Masing laws alike."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.joint.jenkins import jenkins_stiffness, slide
from twin.joint.kinds import SLIDERS
from twin.joint.law import Series, Stiffness


@dataclass(frozen=True)
class ParallelJenkins:
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
    def parameters(self) -> Series:
        """[n, k1, F1, k2, F2, ...]."""
        rows = zip(self.stiffness_N_per_m, self.slip_force_N, strict=True)
        return np.array([len(self.slip_force_N), *(value for row in rows for value in row)], float)

    def path(self, e: Series) -> Series:
        """Force along a path."""
        k, limit = np.array(self.stiffness_N_per_m), np.array(self.slip_force_N)
        force, total = np.zeros(len(k)), np.empty_like(e)
        for i, step in enumerate(np.diff(e, prepend=0.0)):
            force = slide(force, step, k, limit)
            total[i] = force.sum()
        return total

    def stiffness(self, amplitude: Series) -> Stiffness:
        """Equivalent stiffness, the sum of the elements'."""
        pairs = zip(self.stiffness_N_per_m, self.slip_force_N, strict=True)
        return np.asarray(sum(jenkins_stiffness(amplitude, k, F) for k, F in pairs))


def jenkins(stiffness_N_per_m: float, slip_force_N: float) -> ParallelJenkins:
    """A network of one."""
    return ParallelJenkins((stiffness_N_per_m,), (slip_force_N,))
