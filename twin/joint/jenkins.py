"""The Jenkins element: a spring in series with a Coulomb slider, in time and over an amplitude."""

import numpy as np

from twin.joint.law import Series, Stiffness


def slide(force: Series, move: float, stiffness_N_per_m: Series, slip_force_N: Series) -> Series:
    """Forces of elements after a move: a spring that sticks, or slips at its limit."""
    return np.clip(force + stiffness_N_per_m * move, -slip_force_N, slip_force_N)


def jenkins_stiffness(amplitude: Series | float, stiffness_N_per_m: float, slip_force_N: float) -> Stiffness:
    """Describing function.

    The element sticks up to A = F/k; beyond, with cos b = 1 - 2 F/(k A),
    ``(k/pi) (b - sin(2 b)/2) + j (4 F/(pi A)) (1 - F/(k A))``.
    """
    k = stiffness_N_per_m
    r = np.minimum(slip_force_N / (k * np.asarray(amplitude, float)), 1.0)
    b = np.arccos(1.0 - 2.0 * r)
    return np.asarray(k / np.pi * (b - np.sin(2 * b) / 2) + 4j * k / np.pi * r * (1 - r), complex)
