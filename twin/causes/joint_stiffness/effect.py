from twin.bench.plan import Plan


def joint_stiffness(plan: Plan, *, normal_factor: float, shear_factor: float, joint: str = "") -> None:
    """Multiply E' and G'; the softening, a share of E', goes with it, lest it take off more than there is."""
    chosen = plan.joint(joint)
    if chosen.law is not None:
        chosen.law = chosen.law.of_share(normal_factor)
    chosen.E *= normal_factor
    chosen.G *= shear_factor
