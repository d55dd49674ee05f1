from twin.bench.plan import Element, Plan
from twin.joint import Cubic
from twin.rigs import Place


def cubic_stiffness(plan: Plan, *, place: Place, stiffness_N_per_m3: float) -> None:
    """Add f = k v^3 between the structure and the ground."""
    plan.element_makers.append(lambda m: [Element(m.row(place), Cubic(stiffness_N_per_m3))])
