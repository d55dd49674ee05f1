"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {
        "channel": dice.response(),
        "frequency_Hz": dice.plain(1500.0, 3000.0) / dice.strength,
        "damping_ratio": dice.plain(0.02, 0.05),
    }
