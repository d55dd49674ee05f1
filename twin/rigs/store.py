"""Loading rigs, shipped by name or from a TOML file, and writing them back."""

from __future__ import annotations

from pathlib import Path

import tomli_w

from recordings.errors import InputError
from recordings.toml_input import parse_toml, read_toml
from twin.rigs.rig import Rig

__all__ = ["RIG_FILES", "believed_rig_file", "load_rig", "parse_rig", "save_rig"]

RIG_FILES = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
"""The shipped rigs by name."""


def load_rig(name_or_path: str | Path) -> Rig:
    """A shipped rig by name, or a rig file.

    Raises
    ------
    InputError
        If there is no such rig or file, or it does not describe a rig.
    """
    if str(name_or_path) in RIG_FILES:
        return read_toml(RIG_FILES[str(name_or_path)], Rig)
    path = Path(name_or_path)
    if not path.exists() and path.suffix != ".toml":
        raise InputError(path, "", "neither a file nor a shipped rig", f"shipped rigs: {', '.join(RIG_FILES)}")
    return read_toml(path, Rig)


def parse_rig(data: bytes, *, source: str) -> Rig:
    """A rig already in memory, such as the attachment of a recording."""
    return parse_toml(data, Rig, source=source)


def save_rig(rig: Rig, path: Path) -> None:
    """Write `rig` as TOML that `load_rig` reads back equal."""
    path.write_bytes(_toml(rig))


def believed_rig_file(rig: Rig) -> bytes:
    """The rig's file as a recording carries it: without its effects, of which a recording says nothing."""
    return _toml(rig.model_copy(update={"effect": []}))


def _toml(rig: Rig) -> bytes:
    return tomli_w.dumps(rig.model_dump(exclude_none=True, exclude_defaults=True)).encode()
