"""Which of a rig's preloads is meant."""

from __future__ import annotations

from recordings import InputError
from twin.rigs import Rig

__all__ = ["known_preload"]


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
