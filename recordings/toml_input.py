"""Reading TOML from people: size-limited, validated field by field, errors in one line."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from recordings.errors import InputError

__all__ = [
    "Finite",
    "Name",
    "NonNegative",
    "Positive",
    "Question",
    "Table",
    "parse_toml",
    "read_toml",
    "shipped_or_file",
]

Model = TypeVar("Model", bound=BaseModel)

SIZE_LIMIT_BYTES = 1 << 20

Positive = Annotated[float, Field(gt=0, allow_inf_nan=False)]
NonNegative = Annotated[float, Field(ge=0, allow_inf_nan=False)]
Finite = Annotated[float, Field(allow_inf_nan=False)]
Name = Annotated[str, Field(min_length=1, max_length=64)]


class Table(BaseModel):
    """A TOML table: unknown keys are errors, so that a misspelt field is not silently a default."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class Question(BaseModel):
    """What must be known of a file before it is clear which tables it has; all else in it is left for later."""

    model_config = ConfigDict(extra="ignore")


def shipped_or_file(name_or_path: str | Path, shipped: Mapping[str, Path], what: str) -> Path:
    """Path of what is shipped by that name, or of a file; `what` it is, such as ``rig``.

    Raises
    ------
    InputError
        If there is neither.
    """
    path = shipped.get(str(name_or_path), Path(name_or_path))
    if not path.exists() and path.suffix != ".toml":
        raise InputError(path, "", f"neither a file nor a shipped {what}", f"shipped {what}s: {', '.join(shipped)}")
    return path


def read_toml(path: str | Path, model: type[Model]) -> Model:
    """Read and validate a TOML file.

    Parameters
    ----------
    path
        The file.
    model
        The pydantic model it must satisfy.

    Raises
    ------
    InputError
        If the file cannot be read, is larger than 1 MiB, is not TOML, or breaks the model.
    """
    path = Path(path)
    try:
        with path.open("rb") as stream:
            data = stream.read(SIZE_LIMIT_BYTES + 1)
    except OSError as error:
        raise InputError(path, "", (error.strerror or str(error)).lower()) from error
    return parse_toml(data, model, source=path)


def parse_toml(data: bytes, model: type[Model], *, source: str | Path) -> Model:
    """Validate TOML already in memory (an MCAP attachment, say); `source` names it in errors."""
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(source, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for TOML input")
    try:
        table = tomllib.loads(data.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(source, f"byte {error.start}", "not UTF-8 text") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(source, "", f"not valid TOML: {error}") from error
    except RecursionError as error:
        raise InputError(source, "", "nested too deeply") from error
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _first_error(error, source) from error


def _first_error(error: ValidationError, source: str | Path) -> InputError:
    """The first of pydantic's complaints as one line, with the number of further ones."""
    details = error.errors()
    first = details[0]
    place = ".".join(str(part) for part in first["loc"])
    reason = first["msg"].removeprefix("Value error, ")
    value = first.get("input")
    if isinstance(value, (int, float, str, bool)) and first["type"] != "missing":
        reason += f" (got {value!r:.60})"
    more = f"and {len(details) - 1} more problem(s) in this file" if len(details) > 1 else ""
    return InputError(source, place, reason, more)
