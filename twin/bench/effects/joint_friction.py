"""Micro-slip in the joint: a slider on the layer's slip.

The slip of mode 1 changes its sign along the overlap, and its mean over the layer carries no load at all (the beams
pull at each other only through the layer); so the slider acts on the root-mean-square slip in that pattern.
"""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["joint_friction"]


def joint_friction(plan: Plan, *, stiffness_N_per_m: float, slip_force_N: float) -> None:
    """Add a Jenkins element on the layer's rms slip (metres along the interface, in the first mode's pattern)."""
    plan.joint_sliders.append((stiffness_N_per_m, slip_force_N))
