from twin.bench.plan import Plan


def base_motion(plan: Plan, *, receptance_m_per_N: float) -> None:
    """Move what holds the structure by receptance times the drive force, in the drive's direction."""
    if not plan.layout.supports:
        raise ValueError("nothing holds this structure: no base can move it")
    plan.base_receptance += receptance_m_per_N
