"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {**dice.along(0.7, 1.0), "force_N": dice.size(0.01, 0.03)}
