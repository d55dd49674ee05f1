"""Loading procedures, shipped by name or from a TOML file, and writing them back."""

from pathlib import Path
from typing import cast, get_args

import tomli_w
from pydantic import BaseModel

from recordings.errors import InputError
from recordings.toml_input import Question, parse_toml, read_toml, shipped_or_file
from recordings.whole import whole_file
from twin.procedures.kinds import Procedure

PROCEDURE_FILES = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
"""The shipped procedures by name."""

KINDS: dict[str, type[BaseModel]] = {kind.model_fields["procedure"].default: kind for kind in get_args(Procedure)}


class _Kind(Question):
    """The one field that says which table the rest is."""

    procedure: str


def load_procedure(name_or_path: str | Path) -> Procedure:
    """A shipped procedure by name, or a procedure file.

    Raises
    ------
    InputError
        If there is no such procedure or file, or it does not describe a procedure.
    """
    path = shipped_or_file(name_or_path, PROCEDURE_FILES, "procedure")
    return cast(Procedure, read_toml(path, _table(read_toml(path, _Kind), path)))


def parse_procedure(data: bytes, *, source: str | Path) -> Procedure:
    """A procedure already in memory, such as the attachment of a recording; `source` names it in errors."""
    return cast(Procedure, parse_toml(data, _table(parse_toml(data, _Kind, source=source), source), source=source))


def _table(kind: _Kind, source: str | Path) -> type[BaseModel]:
    if kind.procedure not in KINDS:
        raise InputError(source, "procedure", f"no procedure {kind.procedure!r:.60}", f"known: {', '.join(KINDS)}")
    return KINDS[kind.procedure]


def dump_procedure(procedure: Procedure) -> bytes:
    """`procedure` as TOML that `parse_procedure` reads back equal."""
    table = procedure.model_dump(exclude_none=True, exclude_defaults=True, mode="json")
    return tomli_w.dumps({"procedure": procedure.procedure, **table}).encode()


def save_procedure(procedure: Procedure, path: Path) -> None:
    """Write `procedure` as a TOML file, whole or not at all."""
    with whole_file(path) as part:
        part.write_bytes(dump_procedure(procedure))
