"""A clamp that yields in rotation."""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["clamp_compliance"]


def clamp_compliance(plan: Plan, *, rotational_rad_per_Nm: float) -> None:
    """Hold the root by a rotational spring instead of rigidly."""
    if rotational_rad_per_Nm < 0:
        raise ValueError(f"a compliance cannot be negative, got {rotational_rad_per_Nm}")
    plan.clamp_compliance += rotational_rad_per_Nm
