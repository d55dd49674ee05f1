"""One-sided contact, piecewise linear: springs that engage beyond their gaps.

The penalty law of Mayer and Gaul (2011 paper, equation 3) is a sum of such hinges: in terms of the opening Dv its
pressure has slope -c1 below g0, -c2 below 0 and -c3 below -g0.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import HINGES
from twin.joint.law import Marched


@dataclass(frozen=True)
class PiecewiseLinearContact(Marched):
    """f = sum of k_i <s_i (e - g_i)> s_i, where <x> is x where positive and s_i = +1 or -1 is the side of contact.

    Describing function of one hinge with 0 <= g < A: (k / pi) (acos r - r sqrt(1 - r^2)), r = s g / A; the
    formula also holds for -A < s g < 0.  A constant force that such a law also makes is not part of it.
    """

    kind: ClassVar[int] = HINGES
    states: ClassVar[int] = 0
    stiffness_N_per_m: tuple[float, ...]
    gap_m: tuple[float, ...]
    side: tuple[int, ...]

    @property
    def parameters(self) -> Array:
        """[n, k1, g1, s1, k2, ...]."""
        rows = zip(self.stiffness_N_per_m, self.gap_m, self.side, strict=True)
        return np.array([len(self.gap_m), *(value for row in rows for value in row)], float)

    @property
    def least_tangent(self) -> float:
        """Slope of the force where it is least."""
        gaps = np.unique(self.gap_m)
        between = np.concatenate([[gaps[0] - 1.0], (gaps[1:] + gaps[:-1]) / 2.0, [gaps[-1] + 1.0]])
        k, g, s = (np.array(values, float)[:, None] for values in (self.stiffness_N_per_m, self.gap_m, self.side))
        return float(np.min(np.sum(np.where(s * (between - g) > 0.0, k, 0.0), axis=0)))

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness."""
        A = np.asarray(amplitude, float)
        total = np.zeros_like(A)
        for k, g, s in zip(self.stiffness_N_per_m, self.gap_m, self.side, strict=True):
            r = np.clip(s * g / A, -1.0, 1.0)
            total += k / np.pi * (np.arccos(r) - r * np.sqrt(1.0 - r**2))
        return total + 0j


def one_sided(stiffness_N_per_m: float, gap_m: float) -> PiecewiseLinearContact:
    """One spring that engages where e > gap."""
    return PiecewiseLinearContact((stiffness_N_per_m,), (gap_m,), (1,))
