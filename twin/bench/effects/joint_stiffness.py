"""A joint whose moduli differ from what was believed (another torque, another surface)."""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["joint_stiffness"]


def joint_stiffness(plan: Plan, *, normal_factor: float, shear_factor: float) -> None:
    """Multiply E' and G'; the softening, a share of E', goes with it, lest it take off more than there is."""
    if plan.law is not None:
        plan.law = plan.law.of_share(normal_factor)
    plan.E *= normal_factor
    plan.G *= shear_factor
