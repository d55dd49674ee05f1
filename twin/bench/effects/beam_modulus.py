"""A beam of another alloy or thickness than was believed."""

from __future__ import annotations

from typing import Literal

from twin.bench.plan import Plan
from twin.rigs.rig import Beam

__all__ = ["beam_modulus", "change_beam"]


def beam_modulus(plan: Plan, *, beam: Literal["lower", "upper"], factor: float) -> None:
    """Multiply the Young's modulus of one beam."""
    believed = chosen(plan, beam)
    change_beam(plan, beam, believed.model_copy(update={"youngs_modulus": believed.youngs_modulus * factor}))


def chosen(plan: Plan, beam: str) -> Beam:
    """The beam of that name."""
    if beam not in ("lower", "upper"):
        raise ValueError(f"beam must be lower or upper, got {beam!r}")
    value = getattr(plan.rig, beam)
    assert isinstance(value, Beam)
    return value


def change_beam(plan: Plan, beam: str, value: Beam) -> None:
    """Put another beam in its place."""
    plan.rig = plan.rig.model_copy(update={beam: value})
