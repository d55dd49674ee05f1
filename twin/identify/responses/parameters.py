"""What of a rig file an updating may change: moduli, densities, springs, the turning of clamps, joints' moduli."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from twin.identify.responses.limits import LIMITS
from twin.rigs import BeamPart, Rig, StructureRig, Support, moduli_at, with_moduli
from twin.rigs.layout import Spring


@dataclass(frozen=True)
class UpdatedParameter:
    """One number of the rig file, in the coordinate in which it is searched."""

    name: str
    unit: str
    start: float
    std: float
    """Mean and standard deviation beforehand of the coordinate: a logarithm, or a compliance over the beam's own."""
    lower: float
    told: Callable[[float], float]
    """Value of a coordinate, in the unit."""
    apply: Callable[[Rig, float], Rig]
    """The rig with the coordinate's value."""


def parameters_of(rig: Rig, preload: str) -> tuple[UpdatedParameter, ...]:
    """All that may be updated of a rig at a preload; of a rig of format 1 the joint's moduli alone."""
    found: list[UpdatedParameter] = []

    def factor(name: str, unit: str, value: float, std: float, apply: Callable[[Rig, float], Rig]) -> None:
        def told(x: float) -> float:
            return value * math.exp(x)

        def applied(rig: Rig, x: float) -> Rig:
            return apply(rig, told(x))

        found.append(UpdatedParameter(name, unit, 0.0, std, -math.inf, told, applied))

    if isinstance(rig, StructureRig):
        for number, part in enumerate(rig.part):
            if isinstance(part, BeamPart):
                for field, unit, std in (
                    ("youngs_modulus", "N/m2", LIMITS.parameters_modulus),
                    ("density", "kg/m3", LIMITS.parameters_density),
                ):
                    factor(f"{field} {part.name}", unit, getattr(part, field), std, _of("part", number, field))
        springs: list[tuple[str, int, str, Support | Spring]]
        springs = [("support", n, one.part, one) for n, one in enumerate(rig.support)]
        springs += [("spring", n, " ".join(one.between), one) for n, one in enumerate(rig.spring)]
        for table, number, where, one in springs:
            for dof, value in one.stiffness.items():
                unit = "N/m" if len(dof) == 1 else "Nm/rad"
                factor(f"{table} {where} {dof}", unit, value, LIMITS.parameters_spring, _spring(table, number, dof))
            if isinstance(one, Support) and "rz" in one.fix and isinstance(beam := rig.layout().part(where), BeamPart):
                found.append(_clamp(number, beam))
    for number, joint in enumerate(rig.joints):
        for field, told in (("normal_modulus", "E'"), ("shear_modulus", "G'")):
            value, apply = getattr(joint.preload[preload], field), _joint(preload, number, field)
            factor(f"{told} {joint.name}", "N/m2", value, LIMITS.parameters_joint, apply)
    return tuple(found)


def _changed(items: Sequence[Any], number: int, update: dict[str, Any]) -> list[Any]:
    return [item.model_copy(update=update) if n == number else item for n, item in enumerate(items)]


def _of(table: str, number: int, field: str) -> Callable[[Rig, float], Rig]:
    return lambda rig, value: rig.model_copy(update={table: _changed(getattr(rig, table), number, {field: value})})


def _spring(table: str, number: int, dof: str) -> Callable[[Rig, float], Rig]:
    def apply(rig: Rig, value: float) -> Rig:
        items = getattr(rig, table)
        update = {"stiffness": {**items[number].stiffness, dof: value}}
        return rig.model_copy(update={table: _changed(items, number, update)})

    return apply


def _clamp(number: int, beam: BeamPart) -> UpdatedParameter:
    """How much a support that holds a beam's rotation turns, over the beam's own L / EI."""
    unit = beam.length / (beam.youngs_modulus * beam.second_moment)

    def apply(rig: Rig, x: float) -> Rig:
        assert isinstance(rig, StructureRig)
        if x <= LIMITS.least_clamp:
            return rig
        supports = [s.yielding(x * unit) if n == number else s for n, s in enumerate(rig.support)]
        return rig.model_copy(update={"support": supports})

    return UpdatedParameter(
        f"clamp {beam.name}", "rad/Nm", 0.0, LIMITS.parameters_clamp, 0.0, lambda x: x * unit, apply
    )


def _joint(preload: str, number: int, field: str) -> Callable[[Rig, float], Rig]:
    return lambda rig, value: with_moduli(rig, preload, _changed(moduli_at(rig, preload), number, {field: value}))
