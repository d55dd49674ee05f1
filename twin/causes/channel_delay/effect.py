from twin.bench.plan import Plan


def channel_delay(plan: Plan, *, channel: str, delay_s: float) -> None:
    """Delay one channel against the others; ValueError if the delay is negative or longer than 10 ms."""
    if not 0 <= delay_s <= 0.01:
        raise ValueError(f"a channel delay must be between 0 and 0.01 s, got {delay_s}")
    plan.instrument(channel).delay_s += delay_s
