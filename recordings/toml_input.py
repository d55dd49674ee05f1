"""Reading TOML from people: size-limited, validated field by field, errors in one line."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import TypeVar

from pydantic import BaseModel, ValidationError

from recordings.errors import InputError

__all__ = ["parse_toml", "read_toml"]

Model = TypeVar("Model", bound=BaseModel)

SIZE_LIMIT_BYTES = 1 << 20


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
