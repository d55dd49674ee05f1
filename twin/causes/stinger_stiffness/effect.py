from twin.bench.plan import Plan


def stinger_stiffness(plan: Plan, *, stiffness_N_per_m: float) -> None:
    """Tie the drive point to the ground."""
    plan.matrix_changes.append(lambda matrices: matrices.add_spring(plan.drive_place, stiffness_N_per_m))
