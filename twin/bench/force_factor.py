"""What a force factor loses over the armature's stroke, f = c (1/(1 + (x/x_half)^2) - 1) y: it turns y by x.

The one law of two coordinates: y is the current for the armature's force, and the armature's velocity for the
back-EMF.  As both lose the same factor, no energy is made.
"""

from dataclasses import dataclass
from typing import ClassVar

from twin.arrays import Array
from twin.joint.kernel import INNER
from twin.joint.kinds import FORCE_FACTOR


@dataclass(frozen=True)
class ForceFactor:
    """The law for kernels; `turns` names the coordinate y."""

    kind: ClassVar[int] = FORCE_FACTOR
    states: ClassVar[int] = 0
    force_factor: float
    half_stroke_m: float
    turns: str

    def parameters_at(self, stroke: int, turned: int) -> list[float]:
        """[c, x_half, index of x, index of y] where the coordinates have these numbers."""
        return [self.force_factor, self.half_stroke_m, float(stroke), float(turned)]


@INNER
def lost_force(p: Array, row: int, x: float, y: float) -> tuple[float, float, float]:
    """Force and its slopes by x and by y."""
    q = 1.0 / (1.0 + (x / p[row, 1]) * (x / p[row, 1]))
    return p[row, 0] * (q - 1.0) * y, -2.0 * p[row, 0] * q * q * x / (p[row, 1] * p[row, 1]) * y, p[row, 0] * (q - 1.0)
