from twin.bench.plan import Plan


def drive_mass(plan: Plan, *, mass_kg: float) -> None:
    """Fix a point mass to the structure where the force cell sits."""
    plan.matrix_changes.append(lambda m: m.add_mass(plan.drive_place, mass_kg))
