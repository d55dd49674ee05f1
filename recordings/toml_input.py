"""Reading TOML from people: limited before it is parsed, validated field by field, errors in one line."""

import codecs
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, TypeVar

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError

from recordings.errors import InputError, reason_of
from recordings.toml_fields import nearest, told_apart

Model = TypeVar("Model", bound=BaseModel)

SIZE_LIMIT_BYTES = 1 << 20
DEPTH_LIMIT, DOTS_LIMIT, DIGITS_LIMIT, ENTRIES_LIMIT = 32, 32, 64, 100_000
"""Nested brackets, dots of one key, characters of one number, keys and values: far beyond what anybody writes, and far
below what makes the parser slow."""
_TOKEN = re.compile(
    r""""{3}(?:\\.|[^\\])*?"{3}|'{3}.*?'{3}|"(?:\\.|[^"\\\n])*"|'[^'\n]*'|\#[^\n]*"""
    rf"""|(?P<dots>(?:\.[ \t]*+(?:[\w-]++|"[^"\n]*"|'[^'\n]*')?[ \t]*+){{{DOTS_LIMIT}}})"""
    rf"|(?P<digits>[+-]?[0-9][\w.+-]{{{DIGITS_LIMIT}}})|(?P<open>[\[{{])|(?P<close>[\]}}])|(?P<entry>[=,])|[\w-]+",
    re.DOTALL,
)
"""Strings and comments, in which everything is allowed, and what is counted outside them."""
_TOO_LONG = {"dots": f"a key of more than {DOTS_LIMIT} dots", "digits": f"a number of over {DIGITS_LIMIT} digits"}


def _seen(name: str) -> str:
    if not name.isprintable():
        raise ValueError("has a character that cannot be seen")
    return name


Name = Annotated[str, Field(min_length=1, max_length=64), AfterValidator(_seen)]
"""Of a rig, a part, a channel: a word that is shown in many places, and steers none of them."""


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
        meant = nearest(str(name_or_path), shipped)
        remedy = f"perhaps {meant!r} is meant; " if meant else ""
        raise InputError(
            path, "", f"neither a file nor a shipped {what}", f"{remedy}shipped {what}s: {', '.join(shipped)}"
        )
    return path


def read_toml(path: str | Path, model: type[Model]) -> Model:
    """Read a TOML file, and validate it by a pydantic model.

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
        raise InputError(path, "", reason_of(error)) from error
    return parse_toml(data, model, source=path)


def parse_toml(data: bytes, model: type[Model], *, source: str | Path) -> Model:
    """Validate TOML already in memory (an MCAP attachment, say); `source` names it in errors."""
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(source, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for TOML input")
    try:
        text = data.decode(_encoding(data))
        _check_limits(text, source)
        table = tomllib.loads(text)
    except UnicodeDecodeError as error:
        raise InputError(source, f"byte {error.start}", "not UTF-8 text", "save it as UTF-8") from error
    except tomllib.TOMLDecodeError as error:
        raise InputError(source, "", f"not valid TOML: {error}") from error
    try:
        return model.model_validate(table)
    except ValidationError as error:
        raise _first_error(error, source, table, model) from error


def _encoding(data: bytes) -> str:
    """As a byte-order mark says, which editors on Windows write; UTF-8, which TOML is, without one."""
    return "utf-16" if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)) else "utf-8-sig"


def _check_limits(text: str, source: str | Path) -> None:
    """Refuse what the parser would take minutes or gigabytes for; raises InputError with the line."""
    depth = entries = 0
    for token in _TOKEN.finditer(text):
        kind = token.lastgroup
        depth += (kind == "open") - (kind == "close" and depth > 0)
        entries += kind in ("entry", "open")
        told = _TOO_LONG.get(kind or "", "")
        if depth > DEPTH_LIMIT:
            told = f"nested deeper than {DEPTH_LIMIT}"
        elif entries > ENTRIES_LIMIT:
            told = f"more than {ENTRIES_LIMIT} keys and values"
        if told:
            raise InputError(source, f"line {text.count(chr(10), 0, token.start()) + 1}", told)


def _first_error(
    error: ValidationError, source: str | Path, table: Mapping[str, object], model: type[BaseModel]
) -> InputError:
    """What explains most of pydantic's complaints as one line, with the number of further ones."""
    details = error.errors()
    place, reason = told_apart(details, table, model)
    more = f"and {len(details) - 1} more problem(s) in this file" if len(details) > 1 else ""
    return InputError(source, place, reason, more)
