from twin.bench.plan import Plan


def quantisation(plan: Plan, *, channel: str, step: float) -> None:
    """Round one channel to multiples of `step`, in its unit."""
    if step <= 0:
        raise ValueError(f"a quantisation step must be positive, got {step}")
    plan.instrument(channel).step = step
