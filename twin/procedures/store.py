"""Loading procedures, shipped by name or from a TOML file, and writing them back."""

from pathlib import Path
from typing import cast

import tomli_w
from pydantic import BaseModel, ConfigDict

from recordings.errors import InputError
from recordings.toml_input import parse_toml
from twin.procedures.kinds import Dwell, Multisine, Procedure, Random, RingDown, SteppedSine, SweptSine

PROCEDURE_FILES = {path.stem: path for path in sorted(Path(__file__).parent.glob("*.toml"))}
"""The shipped procedures by name."""

KINDS: dict[str, type[BaseModel]] = {
    "stepped-sine": SteppedSine,
    "dwell": Dwell,
    "ring-down": RingDown,
    "random": Random,
    "multisine": Multisine,
    "swept-sine": SweptSine,
}


class _Kind(BaseModel):
    """The one field that says which table the rest is."""

    model_config = ConfigDict(extra="ignore")
    procedure: str


def load_procedure(name_or_path: str | Path) -> Procedure:
    """A shipped procedure by name, or a procedure file.

    Raises
    ------
    InputError
        If there is no such procedure or file, or it does not describe a procedure.
    """
    path = PROCEDURE_FILES.get(str(name_or_path), Path(name_or_path))
    if not path.exists() and path.suffix != ".toml":
        raise InputError(
            path, "", "neither a file nor a shipped procedure", f"shipped procedures: {', '.join(PROCEDURE_FILES)}"
        )
    try:
        with path.open("rb") as stream:
            data = stream.read((1 << 20) + 1)
    except OSError as error:
        raise InputError(path, "", (error.strerror or str(error)).lower()) from error
    return parse_procedure(data, source=path)


def parse_procedure(data: bytes, *, source: str | Path) -> Procedure:
    """A procedure already in memory, such as the attachment of a recording; `source` names it in errors."""
    kind = parse_toml(data, _Kind, source=source).procedure
    if kind not in KINDS:
        raise InputError(source, "procedure", f"no procedure {kind!r:.60}", f"known: {', '.join(KINDS)}")
    return cast(Procedure, parse_toml(data, KINDS[kind], source=source))


def dump_procedure(procedure: Procedure) -> bytes:
    """`procedure` as TOML that `parse_procedure` reads back equal."""
    table = procedure.model_dump(exclude_none=True, exclude_defaults=True, mode="json")
    return tomli_w.dumps({"procedure": procedure.procedure, **table}).encode()


def save_procedure(procedure: Procedure, path: Path) -> None:
    """Write `procedure` as a TOML file."""
    path.write_bytes(dump_procedure(procedure))
