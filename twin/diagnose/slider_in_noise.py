"""A slider under noise: a spring and a dashpot in series, as stiff and as viscous as the motion makes them.

To fast motion a Jenkins element is a spring, for it seldom reaches its slip force within half a period; to slow motion,
beneath fast one that keeps it slipping, it is a dashpot.  Its best linear substitute Z is that of Maxwell,

    Z = C j omega / (j omega + r),   with the force's linear part f and the displacement's power S_x

    E[f^2] = C^2 I = y F^2,   r^2 I = h E[v^2],   I = sum of omega^2 S_x / (omega^2 + r^2).

Which y, h and C belong together was seen on sliders marched under Gaussian motion, from three narrow resonances to
wide bands and from hardly slipping to hardly sticking: all three go by one number, the share of E[v^2] with which it
slips.  In noise of one frequency Z is within 5 % of the mean describing function, and where it slips all the time C / r
is sqrt(2 / pi) F / E[v^2]^(1/2): what Gaussian motion makes of dry friction (Bussgang 1952).
"""

import numpy as np
from scipy.optimize import brentq

from twin.arrays import Array
from twin.diagnose.limits import LIMITS
from twin.identify.model_modification import NoiseMotion


def slider_in_noise(motion: NoiseMotion, omega: Array, k: float, slip_force: float) -> Array:
    """Dynamic stiffness (f,) of the linear substitute of a Jenkins element.

    Parameters
    ----------
    omega : ndarray, (f,)
        Where it is wanted, rad/s.
    k, slip_force
        Stiffness while it sticks, N/m, and force at which it slips, N.
    """
    stiffness, rate = series_spring_and_rate(motion, k, slip_force)
    return np.asarray(stiffness * 1j * omega / (1j * omega + rate))


def series_spring_and_rate(motion: NoiseMotion, k: float, slip_force: float) -> tuple[float, float]:
    """Stiffness C, N/m, of the spring, and its ratio r to the dashpot, 1/s; `k` and zero for one that always sticks."""
    power, omega2 = motion.power * motion.omega**2, motion.omega**2

    def linear(odds: float) -> tuple[float, float, float]:
        slips, sticks = 1 / (1 + np.exp(-odds)), 1 / (1 + np.exp(odds))
        exponent = 0.58 * np.sqrt(slips)
        h = 1 - sticks**exponent
        y = 2 / np.pi * slips**0.3 * (1 - 0.27 * slips * sticks)
        stiffness = k * sticks ** (1 - exponent)
        return y, stiffness, stiffness * motion.velocity * np.sqrt(h / y) / slip_force

    def excess(odds: float) -> float:
        y, stiffness, rate = linear(odds)
        return float(np.log(stiffness**2 * np.sum(power / (omega2 + rate**2)) + 1e-300) - np.log(y * slip_force**2))

    if slip_force <= 0 or k <= 0 or excess(LIMITS.slider_in_noise_least) <= 0:
        return k, 0.0
    odds = (
        LIMITS.slider_in_noise_most
        if excess(LIMITS.slider_in_noise_most) >= 0
        else brentq(excess, LIMITS.slider_in_noise_least, LIMITS.slider_in_noise_most, xtol=1e-13)
    )
    _, stiffness, rate = linear(odds)
    return float(stiffness), float(rate)
