from twin.bench.plan import Plan


def joint_uneven(plan: Plan, *, gradient: float, joint: str = "") -> None:
    """Make E' and G' fall evenly along the overlap, from 1 + gradient/2 of their value to 1 - gradient/2 at its end."""
    chosen = plan.joint(joint)
    chosen.gradient += gradient
    if abs(chosen.gradient) >= 2:
        raise ValueError(f"a gradient of {gradient} would make the modulus negative; it must be between -2 and 2")
