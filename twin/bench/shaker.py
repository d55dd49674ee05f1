"""The electrodynamic shaker on its stinger with its amplifier, as a few state equations and, where it has limits, laws.

    L di/dt = V - R i - Bl(x_a) v_a          (back-EMF)
    m dv_a/dt = Bl(x_a) i - k_s x_a - F      (armature on its suspension)
    F = k (x_a - v_d)                        (stinger, axial)
    Bl(x) = Bl / (1 + (x / x_half)^2)        (the coil leaves the gap's field)

    voltage amplifier: V = g u,   current amplifier: V = Z (g u - i) + R g u

Near a resonance the structure moves easily, so F falls: no force needs to be taken away by hand.  All limits are laws
of one coordinate: the amplifier cuts its voltage off, asks for no more current than it or the rated force allows (one
that holds the voltage gives way instead), and the armature runs into end stops.
"""

from collections.abc import Iterator
from dataclasses import dataclass

from twin.bench.force_factor import ForceFactor
from twin.bench.limits import LIMITS
from twin.joint import PiecewiseLinearContact
from twin.rigs.tables import Shaker

COORDINATES = ("stroke", "armature-velocity", "current", "reference", "command")
"""What a law of the shaker may act on.

`reference` is the current that a current amplifier is asked for; `command` the voltage an amplifier would give had it
no limit of voltage.
"""


@dataclass(frozen=True)
class ShakerModel:
    """The shaker that a rig file's table describes, SI."""

    table: Shaker

    @property
    def output_resistance(self) -> float:
        """Of the amplifier, ohm; zero for one that holds the voltage."""
        return self.table.output_resistance if self.table.amplifier == "current" else 0.0

    @property
    def current_limit(self) -> float | None:
        """Of amplifier or coil, or that of the rated force, A."""
        by_force = self.table.force_limit and self.table.force_limit / self.table.force_factor
        return min((limit for limit in (self.table.current_limit, by_force) if limit), default=None)

    @property
    def command_gain(self) -> float:
        """Volts that the amplifier would give a blocked coil without current, per volt of the generator."""
        if self.output_resistance:
            return self.table.amplifier_gain * (self.table.coil_resistance + self.output_resistance)
        return self.table.amplifier_gain

    def series_stiffness(self, flexibility: float) -> float:
        """Stinger in series with the structure's own residual flexibility at the drive point, N/m."""
        return 1.0 / (1.0 / self.table.stinger_stiffness + flexibility)

    def laws(self) -> Iterator[tuple[str, PiecewiseLinearContact | ForceFactor]]:
        """The coordinate each nonlinear law acts on, and the law; none for a shaker without limits."""
        table = self.table
        if table.voltage_limit:
            yield "command", _beyond(table.voltage_limit, 1.0)
        if self.current_limit and self.output_resistance:
            yield "reference", _beyond(self.current_limit, table.coil_resistance + self.output_resistance)
        elif self.current_limit:
            yield "current", _beyond(self.current_limit, LIMITS.gives_way * table.coil_resistance)
        if table.stroke_limit:
            yield "stroke", _beyond(table.stroke_limit, table.stop_stiffness)
        if table.half_force_stroke:
            # Restoring forces: the armature misses the force that the coil no longer gives, the coil the back-EMF.
            yield "stroke", ForceFactor(-table.force_factor, table.half_force_stroke, "current")
            yield "current", ForceFactor(table.force_factor, table.half_force_stroke, "armature-velocity")


def _beyond(limit: float, slope: float) -> PiecewiseLinearContact:
    """Nothing within +-limit, a spring beyond."""
    return PiecewiseLinearContact((slope, slope), (limit, -limit), (1, -1))
