"""The published JSON Schemas are those of the models, take every shipped file, and refuse what is broken."""

from __future__ import annotations

import copy
import json
import tomllib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator
from make_schemas import FILES, FOLDER, text
from test_misspelt_fields import MAPPING

from twin.procedures.store import PROCEDURE_FILES
from twin.rigs.store import FILES as RIGS

ROOT = Path(__file__).parents[2]
INSTRUMENTS = """
timeout_s = 3.0

[[device]]
name = "daq"
address = "tcp:127.0.0.1:5025"
generator = true

[[device.channel]]
source = "ai0"
name = "force"
quantity = "force"
sensitivity = 0.0112
"""


def rig_schema(table: dict[str, Any]) -> str:
    return f"rig-{table.get('kind') or table.get('format', 1)}"


def shipped() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Name, schema and content of every TOML file of a published kind."""
    for name, path in RIGS.items():
        table = tomllib.loads(path.read_text())
        yield name, rig_schema(table), table
    demo = {path.stem: path for path in (ROOT / "twin" / "demo").glob("*.toml")}
    for name, path in (PROCEDURE_FILES | demo).items():
        yield name, "procedure", tomllib.loads(path.read_text())
    yield "instruments", "instruments", tomllib.loads(INSTRUMENTS)
    yield "mapping", "mapping", tomllib.loads(MAPPING)


SHIPPED = list(shipped())


def validator(name: str) -> Draft202012Validator:
    schema = json.loads((FOLDER / f"{name}.json").read_text())
    Draft202012Validator.check_schema(schema)
    return Draft202012Validator(schema)


@pytest.mark.parametrize("name", FILES)
def test_a_published_schema_is_that_of_the_model(name: str) -> None:
    assert (FOLDER / f"{name}.json").read_text(encoding="utf-8") == text(name), "python docs/make_schemas.py"


@pytest.mark.parametrize(("schema", "table"), [each[1:] for each in SHIPPED], ids=[each[0] for each in SHIPPED])
def test_every_shipped_file_is_valid(schema: str, table: dict[str, Any]) -> None:
    assert [error.message for error in validator(schema).iter_errors(table)] == []


Path_ = tuple[str | int, ...]


def places(here: Any, path: Path_ = ()) -> Iterator[Path_]:
    """Where every value of a table stands, tables first."""
    items = here.items() if isinstance(here, dict) else enumerate(here) if isinstance(here, list) else ()
    for key, value in items:
        yield (*path, key)
        yield from places(value, (*path, key))


def at(table: Any, path: Path_) -> Any:
    for key in path:
        table = table[key]
    return table


def _misspelt(parent: Any, key: Any) -> None:
    parent[f"{key}x"] = parent.pop(key)


def _of_another_type(parent: Any, key: Any) -> None:
    parent[key] = {"what": "ever"} if not isinstance(parent[key], dict) else 3.0


def _negative(parent: Any, key: Any) -> None:
    parent[key] = -1e30


BREAKS: dict[str, Callable[[Any, Any], None]] = {
    "misspelt": _misspelt, "of another type": _of_another_type, "far below zero": _negative,
}  # fmt: skip


def broken() -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Shipped files with one thing wrong each, evenly over what there is."""
    found = []
    for name, schema, table in SHIPPED:
        for path in places(table):
            if not isinstance(path[-1], str) or {"preload", "measured", "law", "effect", "note", "peak"} & set(
                path[:-1]
            ):
                continue  # names that a file gives, and what a law or a cause has of its own
            value = at(table, path)
            for what, breaks in BREAKS.items():
                number = isinstance(value, float) and not isinstance(value, bool)
                if what == "far below zero" and not (number and path[-1] not in ("start", "end")):
                    continue
                changed = copy.deepcopy(table)
                breaks(at(changed, path[:-1]), path[-1])
                found.append((f"{name}: {'.'.join(map(str, path))} {what}", schema, changed))
    step = len(found) // 60
    yield from found[::step]


BROKEN = list(broken())


@pytest.mark.parametrize(("schema", "table"), [each[1:] for each in BROKEN], ids=[each[0] for each in BROKEN])
def test_a_broken_file_is_refused(schema: str, table: dict[str, Any]) -> None:
    assert len(BROKEN) >= 50
    assert not validator(schema).is_valid(table)
