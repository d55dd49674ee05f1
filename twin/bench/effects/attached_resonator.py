"""A small oscillator on the structure: a cable loop, a loose bracket."""

from __future__ import annotations

from twin.bench.plan import Plan

__all__ = ["attached_resonator"]


def attached_resonator(
    plan: Plan, *, position_m: float, mass_kg: float, frequency_Hz: float, damping_ratio: float
) -> None:
    """Hang a mass on a spring and a dashpot; frequency and damping are the resonator's own, on a rigid foundation."""
    plan.matrix_changes.append(
        lambda matrices: matrices.append_resonator(position_m, mass_kg, frequency_Hz, damping_ratio)
    )
