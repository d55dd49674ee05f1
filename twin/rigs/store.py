"""Loading rigs, shipped by name or from a TOML file of either format, and writing them back."""

from pathlib import Path

import tomli_w

from recordings.beside import settled
from recordings.errors import InputError
from recordings.toml_input import Question, parse_toml, read_toml, shipped_or_file
from recordings.whole import whole_file
from twin.rigs.lap_joint import LapJointRig
from twin.rigs.rig import Rig
from twin.rigs.structure_rig import StructureRig

RIG_FILES = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
"""The shipped rigs by name."""

ORDER = ("format", "name", "lower", "upper", "part", "support", "joint", "tie", "mesh", "damping", "drive", "sensor")
"""Tables of a rig file in the order in which they are read; all others follow."""


class _Format(Question):
    """Any rig file's first question."""

    format: int = 1


def load_rig(name_or_path: str | Path) -> Rig:
    """A shipped rig by name, or a rig file.

    Raises
    ------
    InputError
        If there is no such rig or file, or it does not describe a rig.
    """
    path = shipped_or_file(name_or_path, RIG_FILES, "rig")
    rig = read_toml(path, _class(read_toml(path, _Format).format, path))
    return rig.in_folder(path.parent) if isinstance(rig, StructureRig) else rig


def parse_rig(data: bytes, *, source: str) -> Rig:
    """A rig already in memory, such as the attachment of a recording."""
    return parse_toml(data, _class(parse_toml(data, _Format, source=source).format, source), source=source)


def save_rig(rig: Rig, path: Path) -> None:
    """Write `rig` as TOML that `load_rig` reads back equal; its parts' files stay where they are, and are named so."""
    with whole_file(path) as part:
        part.write_bytes(_toml(rig.named_from(settled(path).parent) if isinstance(rig, StructureRig) else rig))


def nominal_rig_file(rig: Rig) -> bytes:
    """The rig's file as a recording carries it: without its effects, of which a recording says nothing."""
    return _toml(rig.model_copy(update={"effect": []}))


def _class(number: int, source: str | Path) -> type[LapJointRig] | type[StructureRig]:
    formats: dict[int, type[LapJointRig] | type[StructureRig]] = {1: LapJointRig, 2: StructureRig}
    if number not in formats:
        raise InputError(source, "format", f"{number} is not known", "there are 1 and 2")
    return formats[number]


def _toml(rig: Rig) -> bytes:
    tables = rig.model_dump(exclude_none=True, exclude_defaults=True, by_alias=True)
    order = {name: number for number, name in enumerate(ORDER)}
    return tomli_w.dumps(dict(sorted(tables.items(), key=lambda item: order.get(item[0], len(order))))).encode()
