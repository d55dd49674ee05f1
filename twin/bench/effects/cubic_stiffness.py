"""A spring to ground that hardens with the cube of the deflection (a taut cable, a membrane)."""

from __future__ import annotations

from twin.bench.plan import Element, Plan
from twin.joint import Cubic

__all__ = ["cubic_stiffness"]


def cubic_stiffness(plan: Plan, *, position_m: float, stiffness_N_per_m3: float) -> None:
    """Add f = k v^3 between the structure and the ground."""
    plan.element_makers.append(lambda m: [Element(m.deflection(position_m), Cubic(stiffness_N_per_m3))])
