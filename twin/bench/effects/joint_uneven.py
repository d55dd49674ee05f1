"""Contact that fades along the overlap."""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["joint_uneven"]


def joint_uneven(plan: Plan, *, gradient: float) -> None:
    """Make E' and G' fall evenly along the overlap, from 1 + gradient/2 of their value to 1 - gradient/2 at its end."""
    plan.layer_gradient += gradient
    if abs(plan.layer_gradient) >= 2:
        raise ValueError(f"a gradient of {gradient} would make the modulus negative; it must be between -2 and 2")
