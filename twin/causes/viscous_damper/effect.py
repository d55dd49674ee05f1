"""A dashpot to ground."""

import numpy as np

from twin.bench.plan import Matrices, Plan


def viscous_damper(
    plan: Plan,
    *,
    damping_Ns_per_m: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    direction: str = "",
) -> None:
    """Add a linear damper between the structure and the ground."""
    place = plan.place(position_m=position_m, part=part, node=node, direction=direction)

    def change(matrices: Matrices) -> None:
        row = matrices.row(place)
        matrices.C += damping_Ns_per_m * np.outer(row, row)

    plan.matrix_changes.append(change)
