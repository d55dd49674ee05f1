"""A mass between force cell and beam, such as an adapter: the beam feels it, the force cell counts it as beam."""

from __future__ import annotations

from twin.bench.effects.added_mass import add_point_mass
from twin.bench.plan import Plan

__all__ = ["drive_mass"]


def drive_mass(plan: Plan, *, mass_kg: float) -> None:
    """Fix a point mass to the structure where the force cell sits."""
    plan.matrix_changes.append(lambda m: add_point_mass(m, plan.rig.force_sensor.position, mass_kg))
