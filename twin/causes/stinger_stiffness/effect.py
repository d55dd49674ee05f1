from twin.bench.plan import Matrices, Plan
from twin.structure.sparse import with_square


def stinger_stiffness(plan: Plan, *, stiffness_N_per_m: float) -> None:
    """Tie the drive point to the ground."""

    def change(matrices: Matrices) -> None:
        matrices.K0 = with_square(matrices.K0, stiffness_N_per_m, matrices.row(plan.drive_place))

    plan.matrix_changes.append(change)
