from twin.bench.plan import Plan


def mains_hum(plan: Plan, *, channel: str, frequency_Hz: float, amplitude: float) -> None:
    """Add a sine of the given peak value, in the channel's unit, with a phase of its own."""
    plan.instrument(channel).hum.append((frequency_Hz, amplitude))
