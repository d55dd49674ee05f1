from twin.bench.plan import Plan


def lost_samples(plan: Plan, *, channel: str) -> None:
    """Freeze one channel for 20 ms, every 5 s on average; sample indices run on."""
    instrument = plan.instrument(channel)
    instrument.freezes_per_s, instrument.freeze_s = 0.2, 0.02
