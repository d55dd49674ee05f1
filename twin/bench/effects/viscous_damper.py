"""A dashpot to ground."""

from __future__ import annotations

import numpy as np

from twin.bench.plan import Matrices, Plan

__all__ = ["viscous_damper"]


def viscous_damper(plan: Plan, *, position_m: float, damping_Ns_per_m: float) -> None:
    """Add a linear damper between the structure and the ground."""

    def change(matrices: Matrices) -> None:
        row = matrices.deflection(position_m)
        matrices.C += damping_Ns_per_m * np.outer(row, row)

    plan.matrix_changes.append(change)
