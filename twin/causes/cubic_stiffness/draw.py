"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """A spring that does as much wherever it is: its work in mode 1 goes with some sixth power of the place."""
    place = dice.along(0.7, 1.0)
    layout = dice.rig.layout()
    length = layout.beam(str(place["part"])).length if "part" in place else layout.length
    return {
        **place,
        "stiffness_N_per_m3": dice.size(3e6, 8e6) * (length / float(place["position_m"])) ** 6,
    }
