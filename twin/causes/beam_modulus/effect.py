"""A beam of another alloy or thickness than was assumed."""

from __future__ import annotations

from twin.bench.plan import Plan
from twin.rigs import BeamPart

__all__ = ["beam_modulus", "chosen"]


def beam_modulus(plan: Plan, *, beam: str, factor: float) -> None:
    """Multiply the Young's modulus of one beam."""
    nominal = chosen(plan, beam)
    plan.layout = plan.layout.with_beam(
        beam, youngs_modulus=nominal.youngs_modulus * factor, shear_ratio=nominal.shear_ratio
    )


def chosen(plan: Plan, beam: str) -> BeamPart:
    """The beam of that name; ValueError if there is none."""
    try:
        return plan.layout.beam(beam)
    except KeyError:
        names = ", ".join(part.name for part in plan.layout.beams) or "none"
        raise ValueError(f"no beam {beam!r}; the rig has {names}") from None
