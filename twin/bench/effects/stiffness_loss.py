"""A crack or a damaged section: bending stiffness lost over one element length of the rig file's mesh."""

from __future__ import annotations

import numpy as np

from twin.bench.plan import Matrices, Plan
from twin.structure.weakened import weakened_elements

__all__ = ["stiffness_loss"]


def stiffness_loss(plan: Plan, *, position_m: float, factor: float) -> None:
    """Multiply the stiffness of the beam by `factor` over a stretch centred at `position_m`.

    The stretch is as long as an average element of the rig file's mesh, wherever it lies in the bench's.  Within the
    overlap it lies in the lower beam.
    """
    if factor <= 0:
        raise ValueError(f"a stiffness factor must be positive, got {factor}")
    plan.matrix_changes.append(lambda matrices: _weaken(plan, matrices, position_m, factor))


def _weaken(plan: Plan, matrices: Matrices, position_m: float, factor: float) -> None:
    mesh = matrices.structure.mesh
    K = np.zeros((3 * mesh.nodes, 3 * mesh.nodes))
    for first, change in weakened_elements(plan.rig, mesh, position_m=position_m, factor=factor):
        K[first : first + 6, first : first + 6] += change
    free = matrices.structure.free
    n = len(free)
    matrices.K_beam[:n, :n] += K[np.ix_(free, free)]
