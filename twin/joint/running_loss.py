"""A loss modulus on the running amplitude: energy lost a cycle depends on the amplitude, not on the rate.

Sliders cannot dissipate more than the stiffness they hold, and the measured loss is many times the layer's shear
modulus; a term c |e|^(k+1) sign(de/dt) can, but has a steep negative tangent when it unloads.  Here the force is
proportional to the velocity, and its coefficient follows running means of the motion itself::

    M0 = mean of e^2,  M1 = mean of v^2,  A = sqrt(2 M0),  w = sqrt(M1/M0),  c = mean of eta(A)/w,  f = c v

where a mean is an exponential one of time tau, M0 and M1 twice over: three stages leave of the squares' ripple at twice
the frequency 1/(2 w tau)^3, some 1e-5.  On a sine of any frequency f is eta(A) times the displacement a quarter period
ahead: the describing function is j eta(A), without harmonics.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from twin.arrays import Array
from twin.joint.kinds import RUNNING_LOSS
from twin.joint.limits import LIMITS

LOSS_POINTS = 1025


@dataclass(frozen=True, eq=False)
class RunningLoss:
    """Loss modulus eta given at equal steps of the amplitude from 0 to `limit_m`, constant beyond.

    It acts on a velocity coordinate, and reads the displacement beside it; the memory is M0, M1, c
    and the first stages of M0 and M1.
    """

    kind: ClassVar[int] = RUNNING_LOSS
    states: ClassVar[int] = 5
    limit_m: float
    eta: Array
    tau_s: float = field(default=0.15)

    @property
    def parameters(self) -> Array:
        """[tau, n, limit, eta0, eta1, ...]."""
        return np.concatenate([[self.tau_s, len(self.eta), self.limit_m], self.eta])

    def modulus(self, amplitude: Array) -> Array:
        """Loss modulus at an amplitude."""
        return np.interp(amplitude, np.linspace(0.0, self.limit_m, len(self.eta)), self.eta)

    def force_history(self, e: Array) -> Array:
        """Force along one or more whole periods of equal steps, with the running means at their steady values."""
        velocity = np.gradient(e)
        A, w = np.sqrt(2 * np.mean(e**2)), np.sqrt(np.mean(velocity**2) / np.mean(e**2))
        return self.modulus(A) * velocity / w

    def describing_function(self, amplitude: Array) -> Array:
        """Equivalent stiffness, imaginary."""
        return np.asarray(1j * self.modulus(np.asarray(amplitude, float)), complex)


def growing_loss(loss: float, reached_at: float, power: float) -> RunningLoss:
    """Loss modulus that grows with a power of the amplitude at first; half of `loss` is there at `reached_at`, m."""
    amplitude = np.linspace(0.0, LIMITS.loss_end * reached_at, LOSS_POINTS)
    share = (amplitude / reached_at) ** power
    return RunningLoss(float(amplitude[-1]), loss * share / (1.0 + share))
