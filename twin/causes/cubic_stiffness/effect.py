"""A spring to ground that hardens with the cube of the deflection (a taut cable, a membrane)."""

from twin.bench.plan import Element, Plan
from twin.joint import Cubic


def cubic_stiffness(
    plan: Plan,
    *,
    stiffness_N_per_m3: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    direction: str = "",
) -> None:
    """Add f = k v^3 between the structure and the ground."""
    place = plan.place(position_m=position_m, part=part, node=node, direction=direction)
    plan.element_makers.append(lambda m: [Element(m.row(place), Cubic(stiffness_N_per_m3))])
