from twin.bench.plan import Plan


def sample_clock(plan: Plan, *, error_ppm: float) -> None:
    """Sample faster than nominal by `error_ppm`; rates and time stamps stay nominal."""
    plan.clock_error += error_ppm * 1e-6
