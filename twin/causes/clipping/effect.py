from twin.bench.plan import Plan


def clipping(plan: Plan, *, channel: str, limit: float) -> None:
    """Limit one channel's signal to +-limit, in its unit."""
    plan.instrument(channel).limit = abs(limit)
