"""A rig's preloads: their names, such as ``120N`` or ``9Nm``, the moduli at each, and the number in a recording."""

import re
from collections.abc import Mapping, Sequence
from typing import TypeVar

from recordings.errors import InputError
from twin.rigs.limits import LIMITS
from twin.rigs.rig import Rig
from twin.rigs.tables import Preload

RigOfItsKind = TypeVar("RigOfItsKind", bound=Rig)


def preload_names(rig: Rig) -> tuple[str, ...]:
    """Of all joints, which share them; none without a joint."""
    return tuple(rig.joints[0].preload) if rig.joints else ()


def preload_name(rig: Rig, name: str | None = None) -> str:
    """The named preload, or the first of the file; KeyError if the rig has no such preload."""
    names = preload_names(rig)
    if name is None or (not name and not rig.joints):
        return next(iter(names), "")
    if name not in names:
        raise KeyError(f"rig {rig.name!r} has no preload {name!r}; it has {', '.join(names)}")
    return name


def moduli_at(rig: Rig, preload: str | None = None) -> tuple[Preload, ...]:
    """E' and G' of every joint at a preload."""
    name = preload_name(rig, preload)
    return tuple(joint.preload[name] for joint in rig.joints)


def moduli_values(rig: Rig, preload: str | None = None) -> tuple[list[float], list[float]]:
    """The same as numbers, N/m2: all E', and all G'."""
    moduli = moduli_at(rig, preload)
    return [m.normal_modulus for m in moduli], [m.shear_modulus for m in moduli]


def with_moduli(rig: RigOfItsKind, preload: str, moduli: Sequence[Preload]) -> RigOfItsKind:
    """The same rig with other moduli of its joints at a preload, which need not be one of the file's."""
    return rig.with_joints([
        joint.model_copy(update={"preload": {**joint.preload, preload: own}})
        for joint, own in zip(rig.joints, moduli, strict=True)
    ])  # fmt: skip


def known_preload(rig: Rig, preload: str | None) -> str:
    """The rig's preload of this name, its first if there is none.

    Raises
    ------
    InputError
        If the rig has not that preload.
    """
    try:
        return preload_name(rig, preload)
    except KeyError as error:
        raise InputError("--preload", "", str(error.args[0])) from error


def preload_record(name: str) -> dict[str, str]:
    """Key and value for a recording's ``run`` record; nothing for a name that is not a number with N or Nm."""
    found = re.fullmatch(r"(\d+(?:\.\d+)?) ?(Nm?)", name)
    return {f"preload_{found[2]}": found[1]} if found else {}


def recorded_preload(info: Mapping[str, str]) -> tuple[float, str] | None:
    """Number and unit in a recording's ``run`` record, if it has them."""
    for unit in ("N", "Nm"):
        if f"preload_{unit}" in info:
            return float(info[f"preload_{unit}"]), unit
    return None


def nearest_preload(rig: Rig, info: Mapping[str, str]) -> tuple[str, float]:
    """The rig's preload that a recording was made at: its name, and how far off it is as a share.

    A meter's reading need not be a round number.  Without one, the rig's first.
    """
    recorded = recorded_preload(info)
    named = {name: recorded_preload(preload_record(name)) for name in preload_names(rig)}
    alike = {name: own[0] for name, own in named.items() if own and recorded and own[1] == recorded[1] and own[0] > 0}
    if recorded is None or not alike:
        return preload_name(rig), 0.0
    name = min(alike, key=lambda n: abs(alike[n] - recorded[0]))
    return name, recorded[0] / alike[name] - 1


def foreign_preload(rig: Rig, info: Mapping[str, str]) -> str | None:
    """A sentence where a recording was made at a preload that the rig file does not have."""
    name, departure = nearest_preload(rig, info)
    if abs(departure) < LIMITS.preloads_near:
        return None
    return f"the recordings' preload is {departure:+.0%} off {name}, the nearest that the rig has: E', G' begin there"
