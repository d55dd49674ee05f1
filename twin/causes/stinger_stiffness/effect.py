import numpy as np

from twin.bench.plan import Matrices, Plan


def stinger_stiffness(plan: Plan, *, stiffness_N_per_m: float) -> None:
    """Tie the drive point to the ground."""

    def change(matrices: Matrices) -> None:
        row = matrices.row(plan.drive_place)
        matrices.K0 += stiffness_N_per_m * np.outer(row, row)

    plan.matrix_changes.append(change)
