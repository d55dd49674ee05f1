from twin.bench.plan import Plan


def ac_coupling(plan: Plan, *, channel: str, corner_Hz: float) -> None:
    """Put one more first-order high-pass into a channel."""
    if corner_Hz <= 0:
        raise ValueError(f"a corner frequency must be positive, got {corner_Hz}")
    plan.instrument(channel).corners_Hz.append(corner_Hz)
