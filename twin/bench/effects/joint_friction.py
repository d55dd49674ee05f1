"""Micro-slip in the joint: a slider on the layer's slip."""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["joint_friction"]


def joint_friction(plan: Plan, *, stiffness_N_per_m: float, slip_force_N: float) -> None:
    """Add a Jenkins element on the layer's rms slip (metres along the interface, in the first mode's pattern)."""
    plan.joint_sliders.append((stiffness_N_per_m, slip_force_N))
