"""The motion of ports and the stiffness there that goes with it, and what harmonics of the motion add to that."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.arrays import Array
from twin.identify.limits import LIMITS


def log_amplitudes(amplitude: Array) -> Array:
    """Their logarithms, finite where nothing moves."""
    return np.asarray(np.log(np.maximum(amplitude, 1e-300)))


@dataclass(frozen=True)
class Added:
    """Stiffness at the ports beside that of the law and the forces, to first order in the openings' log amplitudes."""

    stiffness: Array
    """Complex, N/m, (s, n)."""
    growth: Array
    """The derivative of the openings' stiffness by the logarithms of their amplitudes, (s, p, p)."""
    log_amplitude: Array
    """Where these are so, of m, (s, p)."""

    @staticmethod
    def nothing(shape: tuple[int, ...], points: int) -> Added:
        """At no port of so many steps (s, n)."""
        openings = (*shape[:-1], points)
        return Added(np.zeros(shape, complex), np.zeros((*openings, points), complex), np.zeros(openings))

    def at(self, amplitude: Array) -> Array:
        """The stiffness (s, n) at amplitudes (s, n), m."""
        p, here = self.log_amplitude.shape[-1], self.stiffness.copy()
        here[..., :p] += (self.growth @ (log_amplitudes(amplitude[..., :p]) - self.log_amplitude)[..., None])[..., 0]
        return here

    def of_step(self, number: int) -> Added:
        """One of several steps, each of which holds many."""
        return Added(self.stiffness[number], self.growth[number], self.log_amplitude[number])

    def of_ports(self, count: int) -> Added:
        """For so many ports, the last of which have none, or are left out."""
        missing = max(0, count - self.stiffness.shape[1])
        return replace(self, stiffness=np.pad(self.stiffness[:, :count], [(0, 0), (0, missing)]))


@dataclass(frozen=True)
class Balance:
    """The ports' motion and stiffness where each agrees with the other."""

    motion: Array
    """Complex amplitudes, m, (s, n)."""
    stiffness: Array
    """Complex, N/m, (s, n)."""
    added: Added
    """The part of it that is neither the law's nor the forces': what harmonics of the motion add."""
    unsettled: Array
    """Norm of the relative disagreement that was left, (s,)."""
    ripples: Array | None = None
    """What the nonlinear forces slip into, see :class:`LocalForces`, (s, m, 3)."""

    @property
    def more(self) -> Array:
        """What is added (s, n) at this motion, N/m."""
        return self.added.at(np.abs(self.motion))

    @property
    def missed(self) -> Array:
        """Relative error (s,) of what a step shows for its balance was not found: none where it was, at most one."""
        unsettled = np.nan_to_num(self.unsettled, nan=1.0, posinf=1.0)
        return np.where(unsettled > LIMITS.local_settled, np.minimum(unsettled, 1.0), 0.0)
