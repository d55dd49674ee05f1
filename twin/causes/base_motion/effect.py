"""A foundation that moves with the drive force."""

from twin.bench.plan import Plan


def base_motion(plan: Plan, *, receptance_m_per_N: float) -> None:
    """Move the clamp by receptance times the drive force, in the drive's direction."""
    plan.base_receptance += receptance_m_per_N
