"""A preload's name in a rig, such as ``120N`` or ``9Nm``, beside the number that a recording gives."""

import re
from collections.abc import Mapping

from recordings.errors import InputError
from twin.rigs.limits import LIMITS
from twin.rigs.rig import Rig


def known_preload(rig: Rig, preload: str | None) -> str:
    """The rig's preload of this name, its first if there is none.

    Raises
    ------
    InputError
        If the rig has not that preload.
    """
    try:
        return rig.preload_name(preload)
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
    named = {name: recorded_preload(preload_record(name)) for name in rig.preloads}
    alike = {name: own[0] for name, own in named.items() if own and recorded and own[1] == recorded[1] and own[0] > 0}
    if recorded is None or not alike:
        return rig.preload_name(None), 0.0
    name = min(alike, key=lambda n: abs(alike[n] - recorded[0]))
    return name, recorded[0] / alike[name] - 1


def foreign_preload(rig: Rig, info: Mapping[str, str]) -> str | None:
    """A sentence where a recording was made at a preload that the rig file does not have."""
    name, departure = nearest_preload(rig, info)
    if abs(departure) < LIMITS.preloads_near:
        return None
    return f"the recordings' preload is {departure:+.0%} off {name}, the nearest that the rig has: E', G' begin there"
