"""Harmonics of a slider that sticks until its force is reached, in a structure that lets its slip ripple."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.arrays import Array
from twin.identify.jenkins import LEAST_SLIP, RIPPLES, common_spring


@dataclass(frozen=True)
class Slider:
    """What slipping takes off a spring."""

    stiffness: float
    """Of the spring, N/m."""
    slip_force: float
    """At which it slips, N."""
    compliance: Callable[[Array], Array]
    """Slip per force on it (f, 3) at 3, 5 and 7 times omega (f,), without it, where no law has taken anything off."""

    def equivalent(self, amplitude: Array, omega: Array, compliance: Array | None = None) -> Array:
        """Complex equivalent stiffness at amplitude (f,), with another `compliance` (f, 3) if one is given."""
        compliance = self.compliance(omega) if compliance is None else compliance
        force = slipping_harmonics(amplitude, self.stiffness, self.slip_force, compliance)
        return np.asarray(force[:, 0] / np.maximum(amplitude, LEAST_SLIP) - self.stiffness)

    def harmonics(self, amplitude: Array, count: int, omega: Array, compliance: Array | None = None) -> Array:
        """Complex harmonics 1 ... count (f, count) of the force for motion a cos(omega t)."""
        compliance = self.compliance(omega) if compliance is None else compliance
        force = slipping_harmonics(amplitude, self.stiffness, self.slip_force, compliance)
        out = np.zeros((len(amplitude), max(count, RIPPLES[-1])), complex)
        out[:, [0, *(h - 1 for h in RIPPLES)]] = force
        out[:, 0] -= self.stiffness * amplitude
        return out[:, :count]


def slipping_harmonics(amplitude: Any, k: float, slip_force: float, compliance: Array) -> Array:
    """Harmonics 1, 3, 5, 7 of a Jenkins element's force where only the fundamental a cos t of its slip is given.

    The force's harmonics move the slip, X_h = -C_h F_h, and that ripple the force.  What the compliances have in common
    is a spring c in series, beyond which the motion Y = X + c F ripples little: there the element is one of stiffness
    k / (1 + k c), whose amplitude follows from |Y_1 - c F_1| = a.  The rest, C_h - c, counts to first order: a ripple
    e(t) changes the force by its stiffness times e(t) - e(0) from the reversal until it slips, and not at all after.

    Parameters
    ----------
    amplitude : ndarray, (s,)
    compliance : ndarray, (s, 3)
        Slip per force on it at 3, 5 and 7 times the frequency, without the element.

    Returns
    -------
    ndarray, (s, 4)
    """
    from twin.identify.slipping_kernel import in_series, slide_address  # which numba takes a while to load

    a = np.atleast_1d(np.asarray(amplitude, float))
    C = np.array(np.broadcast_to(compliance, (len(a), len(RIPPLES))), complex, order="C")
    out = np.empty((len(a), 1 + len(RIPPLES)), complex)
    in_series(a, float(k), float(slip_force), common_spring(C), C, out, slide_address())
    return out
