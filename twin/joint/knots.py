"""Laws from knots of softening and loss over amplitude, piecewise cubic between them, as files give them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.arrays import Array
from twin.joint.limits import LIMITS
from twin.joint.running_loss import LOSS_POINTS, RunningLoss
from twin.joint.table import ForceTable, table_from_stiffness


@dataclass(frozen=True, eq=False)
class Curve:
    """A piecewise cubic function of amplitude, constant before its first knot and after its last."""

    knots: Array
    values: Array
    """(k,)."""

    def __call__(self, amplitude: Array) -> Array:
        """Values at amplitudes of any shape."""
        return np.asarray(self._cubics[0](np.clip(amplitude, self.knots[0], self.knots[-1])))

    def slope(self, amplitude: Array) -> Array:
        """Derivatives by amplitude."""
        inside = np.clip(amplitude, self.knots[0], self.knots[-1])
        return np.where(inside == amplitude, self._cubics[1](inside), 0.0)

    @cached_property
    def _cubics(self) -> tuple[PchipInterpolator, PchipInterpolator]:
        cubics = PchipInterpolator(self.knots, self.values)
        return cubics, cubics.derivative()


def table_of_softening(softening: Curve, *, limit_m: float) -> ForceTable:
    """The odd, single-valued force whose describing function is minus the softening.

    Beyond the last knot it levels off instead of ending in a corner, which the harmonics of a sine that hardly reaches
    it meet.
    """
    last_m = float(softening.knots[-1])
    steep, run_out = float(softening.slope(np.array(last_m))), LIMITS.run_out * last_m

    def left(x: Array) -> Array:
        return np.exp(-np.maximum(x - last_m, 0.0) / run_out)

    def stiffness(x: Array) -> Array:
        return -(softening(x) + steep * run_out * (1 - left(x)))

    def slope(x: Array) -> Array:
        return -np.where(x < last_m, softening.slope(x), steep * left(x))

    return table_from_stiffness(stiffness, slope, limit_m=limit_m)


def softening_of_knots(amplitude_m: Sequence[float], softening: Sequence[float]) -> ForceTable:
    """The force with this softening, constant before the first knot and level beyond the last."""
    return table_of_softening(Curve(np.array(amplitude_m), np.array(softening)), limit_m=3.0 * amplitude_m[-1])


def loss_of_knots(amplitude_m: Sequence[float], loss: Sequence[float]) -> RunningLoss:
    """The loss independent of rate that has these values, constant before the first knot and beyond the last."""
    amplitude = np.linspace(0.0, amplitude_m[-1], LOSS_POINTS)
    return RunningLoss(amplitude[-1], Curve(np.array(amplitude_m), np.array(loss))(amplitude))
