"""A stop that the structure touches on one side."""

from twin.bench.plan import Element, Plan
from twin.joint import one_sided


def ground_stop(
    plan: Plan,
    *,
    gap_m: float,
    stiffness_N_per_m: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    direction: str = "",
) -> None:
    """Add a spring that engages where the deflection exceeds the gap."""
    place = plan.place(position_m=position_m, part=part, node=node, direction=direction)
    plan.element_makers.append(lambda m: [Element(m.row(place), one_sided(stiffness_N_per_m, gap_m))])
