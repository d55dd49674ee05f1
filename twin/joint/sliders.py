"""Friction with memory: Jenkins elements, one or several in parallel (Iwan)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from twin.joint.kinds import SLIDERS
from twin.joint.law import Series, Stiffness

__all__ = ["Sliders", "iwan", "jenkins"]


@dataclass(frozen=True)
class Sliders:
    """Springs in series with Coulomb sliders, all in parallel; the state is the force in each.

    A slider sticks up to A = F/k; beyond it the describing function of one is, with cos b = 1 - 2 F/(k A),
    ``(k/pi) (b - sin(2 b)/2) + j (4 F/(pi A)) (1 - F/(k A))``.
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
            force = np.clip(force + k * step, -limit, limit)
            total[i] = force.sum()
        return total

    def stiffness(self, amplitude: Series) -> Stiffness:
        """Equivalent stiffness."""
        A = np.asarray(amplitude, float)
        total = np.zeros(A.shape, complex)
        for k, F in zip(self.stiffness_N_per_m, self.slip_force_N, strict=True):
            r = np.minimum(F / (k * A), 1.0)
            b = np.arccos(1.0 - 2.0 * r)
            total += k / np.pi * (b - np.sin(2 * b) / 2) + 1j * 4 * k / np.pi * r * (1 - r)
        return total


def jenkins(stiffness_N_per_m: float, slip_force_N: float) -> Sliders:
    """One slider."""
    return Sliders((stiffness_N_per_m,), (slip_force_N,))


def iwan(stiffness_N_per_m: float, slip_force_N: float, *, sliders: int = 10) -> Sliders:
    """Equal springs with slip forces spread evenly between 0 and twice their mean (the classical Iwan network)."""
    levels = (np.arange(sliders) + 0.5) / sliders * 2.0 * slip_force_N / sliders
    return Sliders((stiffness_N_per_m / sliders,) * sliders, tuple(float(level) for level in levels))
