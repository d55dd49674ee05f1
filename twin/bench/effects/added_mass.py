"""A mass nobody entered in the model: a forgotten clamp, a cable, a heavier sensor."""

from __future__ import annotations

import numpy as np

from twin.bench.plan import Matrices, Plan

__all__ = ["add_point_mass", "added_mass"]


def added_mass(plan: Plan, *, position_m: float, mass_kg: float) -> None:
    """Fix a point mass to the structure."""
    plan.matrix_changes.append(lambda matrices: add_point_mass(matrices, position_m, mass_kg))


def add_point_mass(matrices: Matrices, position_m: float, mass_kg: float) -> None:
    """Add the mass to both translations at a position."""
    v, u = matrices.deflection(position_m), matrices.pad(matrices.structure.axial(position_m))
    matrices.M += mass_kg * (np.outer(v, v) + np.outer(u, u))
