"""A small oscillator on the structure: a cable loop, a loose bracket."""

from twin.bench.plan import Plan


def attached_resonator(
    plan: Plan,
    *,
    mass_kg: float,
    frequency_Hz: float,
    damping_ratio: float,
    position_m: float | None = None,
    part: str = "",
    node: float | None = None,
    direction: str = "",
) -> None:
    """Hang a mass on a spring and a dashpot; frequency and damping are the resonator's own, on a rigid foundation."""
    place = plan.place(position_m=position_m, part=part, node=node, direction=direction)
    plan.matrix_changes.append(lambda matrices: matrices.append_resonator(place, mass_kg, frequency_Hz, damping_ratio))
