from twin.bench.plan import Plan


def cross_talk(plan: Plan, *, channel: str, source: str, factor: float) -> None:
    """Add `factor` times the source's quantity (in the source's unit) to a channel."""
    plan.instrument(source)
    plan.instrument(channel).cross_talk.append((source, factor))
