from twin.bench.plan import Element, Plan
from twin.joint import one_sided
from twin.rigs import Place


def ground_stop(plan: Plan, *, place: Place, gap_m: float, stiffness_N_per_m: float) -> None:
    """Add a spring that engages where the deflection exceeds the gap."""
    plan.element_makers.append(lambda m: [Element(m.row(place), one_sided(stiffness_N_per_m, gap_m))])
