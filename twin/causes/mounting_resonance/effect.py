from twin.bench.plan import Plan


def mounting_resonance(plan: Plan, *, channel: str, frequency_Hz: float, damping_ratio: float) -> None:
    """Read one channel through a second-order system of unit gain at low frequency."""
    plan.instrument(channel).resonances.append((frequency_Hz, damping_ratio))
