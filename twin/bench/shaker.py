"""The electrodynamic shaker on its stinger, as a few state equations.

    L di/dt = V - R i - Bl v_a          (voltage drive, back-EMF)
    m dv_a/dt = Bl i - k_s x_a - F      (armature on its suspension)
    F = k (x_a - v_d)                   (stinger; the force cell reads F)

Near a resonance the structure moves easily, so F falls: no force needs to be taken away by hand.
"""

from __future__ import annotations

from dataclasses import dataclass

from twin.rigs.rig import Drive

__all__ = ["Shaker"]


@dataclass(frozen=True)
class Shaker:
    """Data-sheet values, SI."""

    armature_mass: float
    suspension_stiffness: float
    force_factor: float
    coil_resistance: float
    coil_inductance: float
    stinger_stiffness: float

    @classmethod
    def of(cls, drive: Drive) -> Shaker:
        """The shaker a rig file describes."""
        return cls(
            drive.armature_mass, drive.suspension_stiffness, drive.force_factor,
            drive.coil_resistance, drive.coil_inductance, drive.stinger_stiffness,
        )  # fmt: skip

    def series_stiffness(self, flexibility: float) -> float:
        """Stinger in series with the structure's own residual flexibility at the drive point, N/m."""
        return 1.0 / (1.0 / self.stinger_stiffness + flexibility)
