"""Laws from knots of softening and loss over amplitude, piecewise cubic between them, as files give them."""

from collections.abc import Sequence

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.arrays import Array
from twin.joint.running_loss import RunningLoss
from twin.joint.table import ForceTable, table_of_softening

LOSS_POINTS = 1025


def softening_of_knots(amplitude_m: Sequence[float], softening: Sequence[float]) -> ForceTable:
    """The odd, single-valued force with this softening, constant before the first knot and level beyond the last."""
    first, last = amplitude_m[0], amplitude_m[-1]
    g1 = PchipInterpolator(amplitude_m, softening)
    dg1 = g1.derivative()

    def value(x: Array) -> Array:
        return np.asarray(g1(np.maximum(x, first)))

    def slope(x: Array) -> Array:
        return np.where(x > first, dg1(np.maximum(x, first)), 0.0)

    return table_of_softening(value, slope, last, limit_m=3.0 * last)


def loss_of_knots(amplitude_m: Sequence[float], loss: Sequence[float]) -> RunningLoss:
    """The loss independent of rate that has these values, constant before the first knot and beyond the last."""
    s = np.array(amplitude_m)
    amplitude = np.linspace(0.0, s[-1], LOSS_POINTS)
    return RunningLoss(amplitude[-1], np.asarray(PchipInterpolator(s, loss)(np.clip(amplitude, s[0], s[-1]))))
