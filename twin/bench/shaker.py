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

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from twin.bench.force_factor import ForceFactor
from twin.bench.limits import LIMITS
from twin.joint import PiecewiseLinearContact
from twin.rigs.tables import Shaker as ShakerTable

COORDINATES = ("stroke", "armature-velocity", "current", "reference", "command")
"""What a law of the shaker may act on.

`reference` is the current that a current amplifier is asked for; `command` the voltage an amplifier would give had it
no limit of voltage.
"""


@dataclass(frozen=True)
class ShakerModel:
    """Data-sheet values, SI.  `output_resistance` is zero for an amplifier that holds the voltage."""

    armature_mass: float
    suspension_stiffness: float
    force_factor: float
    coil_resistance: float
    coil_inductance: float
    stinger_stiffness: float
    output_resistance: float = 0.0
    gain: float = 1.0
    half_force_stroke: float | None = None
    stroke_limit: float | None = None
    stop_stiffness: float = 1.0e6
    voltage_limit: float | None = None
    current_limit: float | None = None

    @classmethod
    def of(cls, drive: ShakerTable) -> ShakerModel:
        """The shaker a rig file describes."""
        currents = [drive.current_limit, drive.force_limit and drive.force_limit / drive.force_factor]
        return cls(
            drive.armature_mass, drive.suspension_stiffness, drive.force_factor,
            drive.coil_resistance, drive.coil_inductance, drive.stinger_stiffness,
            drive.output_resistance if drive.amplifier == "current" else 0.0, drive.amplifier_gain,
            drive.half_force_stroke, drive.stroke_limit, drive.stop_stiffness,
            drive.voltage_limit, min((c for c in currents if c), default=None),
        )  # fmt: skip

    @property
    def command_gain(self) -> float:
        """Volts that the amplifier would give a blocked coil without current, per volt of the generator."""
        if self.output_resistance:
            return self.gain * (self.coil_resistance + self.output_resistance)
        return self.gain

    def series_stiffness(self, flexibility: float) -> float:
        """Stinger in series with the structure's own residual flexibility at the drive point, N/m."""
        return 1.0 / (1.0 / self.stinger_stiffness + flexibility)

    def laws(self) -> Iterator[tuple[str, PiecewiseLinearContact | ForceFactor]]:
        """The coordinate each nonlinear law acts on, and the law; none for a shaker without limits."""
        if self.voltage_limit:
            yield "command", _beyond(self.voltage_limit, 1.0)
        if self.current_limit and self.output_resistance:
            yield "reference", _beyond(self.current_limit, self.coil_resistance + self.output_resistance)
        elif self.current_limit:
            yield "current", _beyond(self.current_limit, LIMITS.gives_way * self.coil_resistance)
        if self.stroke_limit:
            yield "stroke", _beyond(self.stroke_limit, self.stop_stiffness)
        if self.half_force_stroke:
            # Restoring forces: the armature misses the force that the coil no longer gives, the coil the back-EMF.
            yield "stroke", ForceFactor(-self.force_factor, self.half_force_stroke, "current")
            yield "current", ForceFactor(self.force_factor, self.half_force_stroke, "armature-velocity")


def _beyond(limit: float, slope: float) -> PiecewiseLinearContact:
    """Nothing within +-limit, a spring beyond."""
    return PiecewiseLinearContact((slope, slope), (limit, -limit), (1, -1))
