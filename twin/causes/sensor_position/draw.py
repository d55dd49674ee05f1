"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """A sensor shift that stays on the structure."""
    channel, offset = dice.response(), dice.signed(0.006, 0.015)
    _, forth = dice.rig.layout().reach(dice.rig.place_of(channel))
    return {"channel": channel, "offset_m": -abs(offset) if abs(offset) > forth else offset}
