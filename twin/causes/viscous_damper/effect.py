from twin.bench.plan import Matrices, Plan
from twin.rigs import Place
from twin.structure.sparse import with_square


def viscous_damper(plan: Plan, *, place: Place, damping_Ns_per_m: float) -> None:
    """Add a linear damper between the structure and the ground."""

    def change(matrices: Matrices) -> None:
        matrices.C = with_square(matrices.C, damping_Ns_per_m, matrices.row(place))

    plan.matrix_changes.append(change)
