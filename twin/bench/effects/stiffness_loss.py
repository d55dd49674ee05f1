"""A crack or a damaged section: bending stiffness lost over one element length of the rig file's mesh."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from twin.bench.plan import Matrices, Plan
from twin.structure.beam import beam_stiffness, weakened_stiffness

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
    rig, mesh = plan.rig, matrices.structure.mesh
    half = (rig.lower.length + rig.upper.length) / rig.mesh.beam_elements / 2
    lower = position_m <= rig.lower.length
    beam, x, offset = (rig.lower, mesh.lower_x, 0) if lower else (rig.upper, mesh.upper_x, len(mesh.lower_x))
    K = np.zeros((3 * mesh.nodes, 3 * mesh.nodes))
    section = {"EA": beam.youngs_modulus * beam.area, "EI": beam.youngs_modulus * beam.second_moment}
    for e, (a, b) in enumerate(pairwise(x)):
        weak = max(a, position_m - half) - a, min(b, position_m + half) - a
        if weak[0] < weak[1]:
            dofs = np.ix_(*[3 * (offset + e) + np.arange(6)] * 2)
            element = {**section, "length": float(b - a), "shear_ratio": beam.shear_ratio}
            K[dofs] += weakened_stiffness(**element, weak=weak, factor=factor) - beam_stiffness(**element)
    free = matrices.structure.free
    n = len(free)
    matrices.K_beam[:n, :n] += K[np.ix_(free, free)]
