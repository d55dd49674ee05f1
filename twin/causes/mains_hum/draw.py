"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {"channel": dice.response(), "frequency_Hz": 50.0, "amplitude": dice.size(0.2, 1.0)}
