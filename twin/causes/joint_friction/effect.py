from twin.bench.plan import Plan
from twin.joint import jenkins


def joint_friction(
    plan: Plan, *, stiffness_N_per_m: float, slip_force_N: float, layer_element: str = "", joint: str = ""
) -> None:
    """Add a Jenkins element on the slip of a layer element, numbered from 1 where it begins; by default the last."""
    chosen = plan.joint(joint)
    count = next(j.layer_elements for j in plan.rig.joints if j.name == chosen.name)
    number = int(layer_element or count)
    if not 1 <= number <= count:
        raise ValueError(f"the layer has {count} elements, numbered from 1, and no number {layer_element}")
    chosen.sliders.append((number - 1, jenkins(stiffness_N_per_m, slip_force_N)))
