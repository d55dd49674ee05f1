"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {**dice.joint(), "gap_m": dice.plain(1.5e-7, 4e-7), "stiffness_factor": dice.lost(0.08, 0.16)}
