from twin.bench.plan import Element, Plan
from twin.joint import jenkins
from twin.rigs import Place

STICK_m = 2e-6
"""Travel before it slips: contacts are not rigid, and steps need something to resolve."""


def ground_friction(plan: Plan, *, place: Place, force_N: float) -> None:
    """Add Coulomb friction to ground, sticking over a travel of 2 micrometres."""
    plan.element_makers.append(lambda m: [Element(m.row(place), jenkins(force_N / STICK_m, force_N))])
