from twin.bench.plan import Plan
from twin.rigs import Place


def attached_resonator(plan: Plan, *, place: Place, mass_kg: float, frequency_Hz: float, damping_ratio: float) -> None:
    """Hang a mass on a spring and a dashpot; frequency and damping are the resonator's own, on a rigid foundation."""
    plan.matrix_changes.append(lambda matrices: matrices.append_resonator(place, mass_kg, frequency_Hz, damping_ratio))
