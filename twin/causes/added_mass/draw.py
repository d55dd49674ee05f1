"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {**dice.along(0.6, 1.0), "mass_kg": dice.size(0.006, 0.015)}
