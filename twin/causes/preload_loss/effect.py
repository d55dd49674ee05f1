from twin.bench.plan import Plan


def preload_loss(plan: Plan, *, rate_per_s: float, joint: str = "") -> None:
    """Let E' fall as 1 - rate t from the bench's start."""
    plan.joint(joint).rate_per_s += rate_per_s
