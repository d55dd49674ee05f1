from twin.bench.plan import Plan


def temperature_drift(plan: Plan, *, rate_per_s: float) -> None:
    """Let all stiffness fall as 1 - rate t from the bench's start."""
    plan.moduli_rate_per_s += rate_per_s
