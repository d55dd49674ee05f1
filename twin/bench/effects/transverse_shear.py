"""A beam that yields in shear as well as in bending (a core, a laminate): Timoshenko instead of Euler-Bernoulli."""

from __future__ import annotations

from typing import Literal

from twin.bench.effects.beam_modulus import change_beam, chosen
from twin.bench.plan import Plan

__all__ = ["transverse_shear"]


def transverse_shear(plan: Plan, *, beam: Literal["lower", "upper"], modulus_ratio: float) -> None:
    """Give one beam the ratio E / (kappa G), beside what it has of it."""
    believed = chosen(plan, beam)
    change_beam(plan, beam, believed.model_copy(update={"shear_ratio": believed.shear_ratio + modulus_ratio}))
