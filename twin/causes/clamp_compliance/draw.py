"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    layout = dice.rig.layout()
    held = [s.part for s in layout.supports if "rz" in s.fix and s.part in {beam.name for beam in layout.beams}]
    if not held:
        raise ValueError("clamp-compliance needs a support that holds a beam's rotation")
    beam = layout.beam(held[0])
    return {"rotational_rad_per_Nm": dice.size(5e-3, 1e-2) * layout.length / (beam.youngs_modulus * beam.second_moment)}
