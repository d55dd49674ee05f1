"""A misspelt field is named with the one that is meant, in every kind of file; marks and line ends are read."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable
from pathlib import Path

import pytest

from drivers.instruments import Instruments
from recordings.errors import InputError
from recordings.importing import Mapping
from recordings.toml_input import parse_toml
from twin.procedures import PROCEDURE_FILES
from twin.procedures.store import parse_procedure
from twin.rigs import RIG_FILES, load_rig, parse_rig

INSTRUMENTS = """
timeout_s = 3.0

[[device]]
name = "daq"
address = "tcp:127.0.0.1:5025"
generator = true
bitrate = 500000

[[device.channel]]
source = "ai0"
quantity = "force"
sensitivity = 0.0112
position_m = 0.05
"""
MAPPING = """
sample_rate_Hz = 1000.0
time = "t"
time_unit = "ms"
delimiter = ";"
decimal = ","
target = "force"
excitation = "stepped-sine"
preload_N = 120.0

[[channel]]
column = "ai0"
name = "force"
quantity = "force"
unit = "V"
scale = 10.0
sensitivity = "22.4 mV/lbf"
position_m = 0.05
direction = "+y"
"""
Reader = Callable[[bytes], object]
KINDS: dict[str, tuple[str, Reader]] = {
    "steel-lap-joint": (RIG_FILES["steel-lap-joint"].read_text(), lambda data: parse_rig(data, source="my.toml")),
    "two-lap-joints": (RIG_FILES["two-lap-joints"].read_text(), lambda data: parse_rig(data, source="my.toml")),
    "steel-sweeps": (PROCEDURE_FILES["steel-sweeps"].read_text(), lambda data: parse_procedure(data, source="my.toml")),
    "instruments": (INSTRUMENTS, lambda data: parse_toml(data, Instruments, source="my.toml")),
    "mapping": (MAPPING, lambda data: parse_toml(data, Mapping, source="my.toml")),
}
FIELD = re.compile(r"^(?:\[+)?([a-z][a-zA-Z_]{3,})(?=\s*=|\])", re.MULTILINE)


def typos() -> list[tuple[str, str, int, str]]:
    """(kind of file, field, where it stands, how it is misspelt): a letter left out, doubled, or two exchanged."""
    found = []
    for kind, (text, _) in KINDS.items():
        seen = set()
        for match in FIELD.finditer(text):
            name = match[1]
            if name in seen or (
                f"[[{name}]]" in text and f"[{name}." in text
            ):  # the tables below it would hang in the air
                continue
            seen.add(name)
            middle = len(name) // 2
            for wrong in (
                name[:middle] + name[middle + 1 :],
                name[:middle] + name[middle] + name[middle:],
                name[: middle - 1] + name[middle] + name[middle - 1] + name[middle + 1 :],
            ):
                if wrong != name:
                    found.append((kind, name, match.start(1), wrong))
    return found


TYPOS = typos()


@pytest.mark.parametrize(("kind", "name", "start", "wrong"), TYPOS, ids=[f"{t[0]}: {t[3]}" for t in TYPOS])
def test_a_typo_is_named_with_what_is_meant(kind: str, name: str, start: int, wrong: str) -> None:
    assert len(TYPOS) >= 50
    text, read = KINDS[kind]
    with pytest.raises(InputError) as told:
        read((text[:start] + wrong + text[start + len(name) :]).encode())
    line = str(told.value)
    assert f"perhaps {name!r} is meant" in line or f"perhaps {wrong!r} is a misspelt {name!r}" in line, line
    assert "\n" not in line


def test_a_field_like_no_other_is_told_with_what_is_possible() -> None:
    text, read = KINDS["steel-lap-joint"]
    without_law = re.sub(r"^law = .*$", "colour = 1", text, flags=re.MULTILINE)
    with pytest.raises(InputError, match=r"joint\.colour: no such field; beside what is there, law .*possible"):
        read(without_law.encode())


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_byte_order_marks_and_line_ends_of_windows_are_read(encoding: str, end: str, tmp_path: Path) -> None:
    text = RIG_FILES["steel-lap-joint"].read_text().replace("\n", end)
    (tmp_path / "rig.toml").write_bytes(text.encode(encoding))
    assert (tmp_path / "rig.toml").read_bytes().startswith((codecs.BOM_UTF8, codecs.BOM_UTF16_LE))
    assert load_rig(tmp_path / "rig.toml") == load_rig("steel-lap-joint")


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ('kind = "beam"', "'beam' is a beam alone; here a rig of format 1 or 2 is needed; 'twin diagnose"),
        ('kind = "modal"', "'modal' is one measured mode; here a rig of format 1 or 2 is needed; 'twin identify"),
        (
            'kind = "plate"',
            "'plate' is no kind of rig; there are 'beam', 'modal', 'substructures'; a structure has none",
        ),
        ("format = 3", "3 is not known; there are 1 and 2"),
    ],
)
def test_a_rig_of_another_kind_is_told_where_it_is_of_use(text: str, said: str) -> None:
    with pytest.raises(InputError, match=re.escape(said)):
        parse_rig(text.encode(), source="my.toml")


@pytest.mark.parametrize("name", ["brake-reuss", "composite-beam"])
def test_a_shipped_rig_without_a_structure_is_known_by_name(name: str) -> None:
    with pytest.raises(InputError, match=r"kind: .*here a rig of format 1 or 2 is needed"):
        load_rig(name)


def test_a_shipped_name_that_is_misspelt_is_named() -> None:
    with pytest.raises(InputError, match="perhaps 'steel-lap-joint' is meant"):
        load_rig("steel-lapjoint")
