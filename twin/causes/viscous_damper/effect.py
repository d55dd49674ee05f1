import numpy as np

from twin.bench.plan import Matrices, Plan
from twin.rigs import Place


def viscous_damper(plan: Plan, *, place: Place, damping_Ns_per_m: float) -> None:
    """Add a linear damper between the structure and the ground."""

    def change(matrices: Matrices) -> None:
        row = matrices.row(place)
        matrices.C += damping_Ns_per_m * np.outer(row, row)

    plan.matrix_changes.append(change)
