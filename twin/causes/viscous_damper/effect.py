from twin.bench.plan import Plan
from twin.rigs import Place


def viscous_damper(plan: Plan, *, place: Place, damping_Ns_per_m: float) -> None:
    """Add a linear damper between the structure and the ground."""
    plan.matrix_changes.append(lambda matrices: matrices.add_damper(place, damping_Ns_per_m))
