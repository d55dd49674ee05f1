"""Laws from knots of softening and loss over amplitude, piecewise cubic between them, as files give them."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.joint.law import Series
from twin.joint.limits import LIMITS
from twin.joint.running_loss import RunningLoss
from twin.joint.table import ForceTable, table_from_stiffness

LOSS_POINTS = 1025


def softening_of_knots(amplitude_m: Sequence[float], softening: Sequence[float]) -> ForceTable:
    """The one odd, single-valued force whose describing function is minus the softening.

    It is constant before the first knot, and levels off beyond the last instead of ending in a corner, which a sine of
    nearly that amplitude already meets with its harmonics.
    """
    o = np.array(amplitude_m)
    g1 = PchipInterpolator(o, softening)
    dg1 = g1.derivative()
    last, run_out = float(dg1(o[-1])), LIMITS.run_out * o[-1]

    def beyond(x: Series) -> Series:
        return np.exp(-np.maximum(x - o[-1], 0.0) / run_out)

    def stiffness(x: Series) -> Series:
        return -np.asarray(g1(np.clip(x, o[0], o[-1])) + last * run_out * (1 - beyond(x)))

    def slope(x: Series) -> Series:
        inside = np.where(x > o[0], dg1(np.clip(x, o[0], o[-1])), 0.0)
        return -np.where(x < o[-1], inside, last * beyond(x))

    return table_from_stiffness(stiffness, slope, limit_m=3.0 * o[-1])


def loss_of_knots(amplitude_m: Sequence[float], loss: Sequence[float]) -> RunningLoss:
    """The loss independent of rate that has these values, constant before the first knot and beyond the last."""
    s = np.array(amplitude_m)
    amplitude = np.linspace(0.0, s[-1], LOSS_POINTS)
    return RunningLoss(amplitude[-1], np.asarray(PchipInterpolator(s, loss)(np.clip(amplitude, s[0], s[-1]))))
