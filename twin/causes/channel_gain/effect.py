from twin.bench.plan import Plan


def channel_gain(plan: Plan, *, channel: str, factor: float) -> None:
    """Multiply one channel's signal."""
    plan.instrument(channel).gain *= factor
