"""A crack or a damaged section: bending stiffness lost over one element length of the rig file's mesh."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from twin.bench.plan import Matrices, Plan
from twin.structure.beam import beam_stiffness

__all__ = ["stiffness_loss"]


def stiffness_loss(plan: Plan, *, position_m: float, factor: float) -> None:
    """Multiply the stiffness of the beam by `factor` over a stretch centred at `position_m`.

    The stretch is as long as an average element of the rig file's mesh; bench elements that it covers in part are
    changed in part.  Within the overlap it lies in the lower beam.
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
    for e, (a, b) in enumerate(pairwise(x)):
        covered = max(0.0, min(b, position_m + half) - max(a, position_m - half)) / (b - a)
        if covered > 0:
            dofs = np.ix_(*[3 * (offset + e) + np.arange(6)] * 2)
            EA, EI = beam.youngs_modulus * beam.area, beam.youngs_modulus * beam.second_moment
            whole = beam_stiffness(EA=EA, EI=EI, length=b - a, shear_ratio=beam.shear_ratio)
            # Compliances add along the element: a part `covered` of it has 1/factor times the flexibility.
            K[dofs] += (1.0 / (1.0 - covered + covered / factor) - 1.0) * whole
    free = matrices.structure.free
    n = len(free)
    matrices.K_beam[:n, :n] += K[np.ix_(free, free)]
