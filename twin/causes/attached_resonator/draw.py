"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {
        **dice.along(0.4, 1.0),
        "mass_kg": dice.size(0.003, 0.01),
        "frequency_Hz": dice.plain(60.0, 400.0),
        "damping_ratio": dice.plain(0.01, 0.03),
    }
