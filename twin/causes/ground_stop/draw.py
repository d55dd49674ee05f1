"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {
        **dice.along(0.7, 1.0),
        "gap_m": dice.plain(3e-4, 1.2e-3),
        "stiffness_N_per_m": dice.size(50.0, 200.0),
    }
