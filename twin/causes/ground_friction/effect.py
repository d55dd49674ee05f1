"""Dry friction between the structure and something fixed: a cable tie, a touching cover."""

from twin.bench.plan import Element, Plan
from twin.joint import jenkins

STICK_m = 2e-6
"""Travel before it slips: contacts are not rigid, and steps need something to resolve."""


def ground_friction(
    plan: Plan,
    *,
    force_N: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    direction: str = "",
) -> None:
    """Add Coulomb friction to ground, sticking over a travel of 2 micrometres."""
    place = plan.place(position_m=position_m, part=part, node=node, direction=direction)
    plan.element_makers.append(lambda m: [Element(m.row(place), jenkins(force_N / STICK_m, force_N))])
