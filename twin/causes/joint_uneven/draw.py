"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

import numpy as np

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    return {**dice.joint(), "gradient": float(np.clip(dice.signed(0.8, 1.5), -1.8, 1.8))}
