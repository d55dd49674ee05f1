from twin.bench.layer import slapping
from twin.bench.plan import Plan


def joint_slap(plan: Plan, *, gap_m: float, stiffness_factor: float, joint: str = "") -> None:
    """Where the layer's rms opening exceeds the gap, its force goes on with `stiffness_factor` of its stiffness.

    The opening counts from rest and is positive where the tip moves to +y.
    """
    if stiffness_factor <= 0:
        raise ValueError(f"a stiffness factor must be positive, got {stiffness_factor}")
    plan.joint(joint).law_changes.append(lambda law, E: slapping(law, E=E, gap_m=gap_m, factor=stiffness_factor))
