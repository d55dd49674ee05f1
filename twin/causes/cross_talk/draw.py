"""How large it usually is, for a rig of the steel rig's kind."""

from __future__ import annotations

from twin.causes.dice import Dice, Parameters

__all__ = ["draw"]


def draw(dice: Dice) -> Parameters:
    """Parameters of normal size."""
    sources = [s.channel for s in dice.rig.sensors]
    channel = dice.response()
    source = str(dice.rng.choice([c for c in sources if c != channel]))
    scale = 20.0 if source == dice.rig.force_sensor.channel else 1.0
    return {"channel": channel, "source": source, "factor": scale * dice.signed(0.01, 0.04)}
