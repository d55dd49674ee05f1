"""A law of the layer's points as a table: softening over a point's opening, loss over its slip."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.interpolate import PchipInterpolator

from twin.arrays import Array


@dataclass(frozen=True, eq=False)
class Curve:
    """A piecewise cubic function of amplitude, constant before its first knot and after its last."""

    knots: Array
    values: Array
    """(k,)."""

    def __call__(self, amplitude: Array) -> Array:
        """Values at amplitudes of any shape."""
        return np.asarray(self._cubics[0](np.clip(amplitude, self.knots[0], self.knots[-1])))

    def by_log(self, amplitude: Array) -> Array:
        """Derivatives by the logarithm of amplitude."""
        inside = np.clip(amplitude, self.knots[0], self.knots[-1])
        return np.where(inside == amplitude, self._cubics[1](inside) * inside, 0.0)

    @cached_property
    def _cubics(self) -> tuple[PchipInterpolator, PchipInterpolator]:
        cubics = PchipInterpolator(self.knots, self.values)
        return cubics, cubics.derivative()


@dataclass(frozen=True, eq=False)
class LayerPointLaw:
    """What a point's opening (m) takes off E', and what its slip (m) adds to G' as a loss modulus, N/m2."""

    softening: Curve
    loss: Curve
