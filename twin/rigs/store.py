"""Loading rigs of every kind, shipped by name or from a TOML file, and writing them back."""

from pathlib import Path
from typing import Annotated

import tomli_w
from pydantic import BeforeValidator

from recordings.beside import settled
from recordings.errors import InputError
from recordings.toml_input import Question, parse_toml, read_toml, shipped_or_file
from recordings.whole import whole_file
from twin.rigs.beam import BeamRig
from twin.rigs.lap_joint import LapJointRig
from twin.rigs.modal import ModalRig
from twin.rigs.rig import Rig
from twin.rigs.structure_rig import StructureRig
from twin.rigs.substructures import SubstructuresRig

AnyRig = Rig | BeamRig | ModalRig

RIG_FILES = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
"""The shipped structures by name."""

FILES = RIG_FILES | {
    path.stem: path
    for folder in ("beam_rigs", "modal_rigs")
    for path in sorted((Path(__file__).parent / folder).glob("*.toml"))
}
"""All shipped rigs by name."""

NO_STRUCTURES = {
    "beam": ("a beam alone", "'twin diagnose FREQUENCIES.csv --rig' takes it"),
    "modal": ("one measured mode", "'twin identify SWEEPS.csv --rig' and 'twin diagnose' take it"),
    "substructures": ("a rig with a part that is known by its responses only", "'twin couple' predicts it"),
}
"""Kinds of rigs that have no whole structure with drive and sensors: what they are, and what they are for."""

ORDER = (
    "kind", "format", "name", "lower", "upper", "part", "support", "joint", "tie", "mesh", "damping", "drive", "sensor",
)  # fmt: skip
"""Tables of a rig file in the order in which they are read; all others follow."""


class _First(Question):
    """Any rig file's first question; a kind of another type is none of those there are."""

    kind: Annotated[str | None, BeforeValidator(lambda kind: kind if isinstance(kind, str) else "")] = None
    format: int = 1


def load_rig(name_or_path: str | Path) -> Rig:
    """A shipped rig by name, or a rig file.

    Raises
    ------
    InputError
        If there is no such rig or file, or it does not describe a rig, or one without a structure.
    """
    path = shipped_or_file(name_or_path, FILES, "rig")
    rig = read_toml(path, _class(read_toml(path, _First), path))
    return rig.in_folder(path.parent) if isinstance(rig, StructureRig) else rig


def load_any_rig(name_or_path: str | Path) -> AnyRig:
    """A shipped rig by name, or a rig file: a structure with drive and sensors, a beam alone, or one measured mode.

    InputError if there is no such rig or file, or it does not describe a rig.
    """
    path = shipped_or_file(name_or_path, FILES, "rig")
    kinds: dict[str | None, type[BeamRig] | type[ModalRig]] = {"beam": BeamRig, "modal": ModalRig}
    model = kinds.get(read_toml(path, _First).kind)
    return load_rig(name_or_path) if model is None else read_toml(path, model)


def load_substructures(path: str | Path) -> SubstructuresRig:
    """A rig file of substructures; InputError if there is no such file, or it does not describe one."""
    file = shipped_or_file(path, FILES, "rig")
    if read_toml(file, _First).kind != "substructures":
        remedy = 'one with kind = "substructures" has a [[measured_part]] and a [[connection]]'
        raise InputError(path, "kind", "is a rig without parts known by their responses", remedy)
    return read_toml(file, SubstructuresRig).in_folder(file.parent)


def parse_rig(data: bytes, *, source: str) -> Rig:
    """A rig already in memory, such as the attachment of a recording."""
    return parse_toml(data, _class(parse_toml(data, _First, source=source), source), source=source)


def save_rig(rig: AnyRig, path: Path) -> None:
    """Write `rig` as TOML that is read back equal; its parts' files stay where they are, and are named so."""
    with whole_file(path) as part:
        part.write_bytes(_toml(rig.named_from(settled(path).parent) if isinstance(rig, StructureRig) else rig))


def nominal_rig_file(rig: Rig) -> bytes:
    """The rig's file as a recording carries it: without its effects, of which a recording says nothing."""
    return _toml(rig.model_copy(update={"effect": []}))


def no_structure(kind: str, source: str | Path) -> InputError:
    """What is told where a rig of :data:`NO_STRUCTURES` is given to whatever needs a structure."""
    what, where = NO_STRUCTURES[kind]
    return InputError(source, "kind", f"{kind!r} is {what}", f"here a rig of format 1 or 2 is needed; {where}")


def _class(first: _First, source: str | Path) -> type[LapJointRig] | type[StructureRig]:
    formats: dict[int, type[LapJointRig] | type[StructureRig]] = {1: LapJointRig, 2: StructureRig}
    if first.kind in NO_STRUCTURES:
        raise no_structure(first.kind, source)
    if first.kind is not None:
        reason = f"{first.kind!r:.60} is no kind of rig"
        remedy = f"there are {', '.join(map(repr, NO_STRUCTURES))}; a structure has none, but format = 2 and its parts"
        raise InputError(source, "kind", reason, remedy)
    if first.format not in formats:
        raise InputError(source, "format", f"{first.format} is not known", "there are 1 and 2")
    return formats[first.format]


def _toml(rig: AnyRig) -> bytes:
    tables = rig.model_dump(exclude_none=True, exclude_defaults=isinstance(rig, Rig), by_alias=True)
    order = {name: number for number, name in enumerate(ORDER)}
    return tomli_w.dumps(dict(sorted(tables.items(), key=lambda item: order.get(item[0], len(order))))).encode()
