"""Dry friction between the structure and something fixed: a cable tie, a touching cover."""

from __future__ import annotations

from twin.bench.plan import Element, Plan
from twin.joint import jenkins

__all__ = ["ground_friction"]

STICK_m = 2e-6
"""Travel before it slips: contacts are not rigid, and steps need something to resolve."""


def ground_friction(plan: Plan, *, position_m: float, force_N: float) -> None:
    """Add Coulomb friction to ground, sticking over a travel of 2 micrometres."""
    plan.element_makers.append(lambda m: [Element(m.deflection(position_m), jenkins(force_N / STICK_m, force_N))])
