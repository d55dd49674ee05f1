"""A stop that the structure touches on one side."""

from __future__ import annotations

from twin.bench.plan import Element, Plan
from twin.joint import one_sided

__all__ = ["ground_stop"]


def ground_stop(plan: Plan, *, position_m: float, gap_m: float, stiffness_N_per_m: float) -> None:
    """Add a spring that engages where the deflection exceeds the gap."""
    plan.element_makers.append(lambda m: [Element(m.deflection(position_m), one_sided(stiffness_N_per_m, gap_m))])
