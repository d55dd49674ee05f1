"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """A friction spring that begins to slip within the amplitudes of the steel rig's sweeps."""
    stiffness = float(dice.size(1.5e8, 3e8))
    chosen = dice.joint()
    joint = next(joint for joint in dice.rig.joints if chosen.get("joint", joint.name) == joint.name)
    element = dice.rng.choice([1, joint.layer_elements])
    return {
        **chosen,
        "layer_element": str(element),
        "stiffness_N_per_m": stiffness,
        "slip_force_N": stiffness * dice.plain(2e-7, 4e-7),
    }
