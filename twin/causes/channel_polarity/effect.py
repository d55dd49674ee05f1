from twin.bench.plan import Plan


def channel_polarity(plan: Plan, *, channel: str) -> None:
    """Turn one channel's sign."""
    plan.instrument(channel).gain *= -1.0
