from twin.bench.plan import Plan


def clamp_compliance(plan: Plan, *, rotational_rad_per_Nm: float, support: str = "") -> None:
    """Hold a clamp by a rotational spring instead of rigidly: that of a part, or every one."""
    if rotational_rad_per_Nm < 0:
        raise ValueError(f"a compliance cannot be negative, got {rotational_rad_per_Nm}")
    held = [s.part for s in plan.layout.supports if s.holds_rotation and support in ("", s.part)]
    if not held:
        raise ValueError(f"no support of {support or 'any part'} holds its rotation")
    if rotational_rad_per_Nm:
        plan.layout = plan.layout.with_yielding_supports(rotational_rad_per_Nm, part=support or None)
