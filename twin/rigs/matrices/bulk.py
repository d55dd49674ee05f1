"""Entries of Nastran bulk data: fields of 8 or 16 characters, or between commas, over as many lines as they need."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from recordings.errors import InputError
from twin.rigs.matrices.numbers import fortran_number

T = TypeVar("T")

LINE_FIELDS = {8: 8, 16: 4}
"""Fields of a line by their width; the name before them and the mark of continuation behind are none."""


@dataclass(frozen=True)
class Entry:
    """One entry: its name, and the texts of its fields after that."""

    path: Path
    line: int
    """Of the file, where it begins, from 1."""
    name: str
    fields: list[str]

    def text(self, at: int) -> str:
        """One field, empty if it is not given."""
        return self.fields[at] if at < len(self.fields) else ""

    def integer(self, at: int, *, default: int | None = None) -> int:
        """One field as a whole number; InputError if it is none."""
        return self._read(at, int, default, "not a whole number")

    def number(self, at: int, *, default: float | None = None) -> float:
        """One field as a number; InputError if it is none."""
        return self._read(at, fortran_number, default, "not a number")

    def _read(self, at: int, convert: Callable[[str], T], default: T | None, otherwise: str) -> T:
        text = self.text(at)
        if not text and default is not None:
            return default
        try:
            return convert(text)
        except ValueError:
            raise self.refusal(at, otherwise) from None

    def refusal(self, at: int, reason: str) -> InputError:
        """The error of one field."""
        place = f"line {self.line}, {self.name} field {at + 2}"
        return InputError(self.path, place, f"{self.text(at)[:30]!r} is {reason}", "export it again")


def entries(path: Path, data: bytes, *names: str) -> Iterator[Entry]:
    """All entries of these names, in the file's order; comments and other entries are passed over."""
    wanted = {name.encode() for name in names}
    open_entry: Entry | None = None
    for line, raw in enumerate(data.splitlines(), 1):
        text = raw.partition(b"$")[0].rstrip()
        if not text:
            continue
        if text[:1] in b" +*,":
            if open_entry is not None:
                open_entry.fields.extend(_fields(text.decode("latin-1")))
            continue
        if open_entry is not None:
            yield open_entry
        name = text[:8].partition(b",")[0].rstrip(b"* ").upper()
        open_entry = (
            Entry(path, line, name.decode("latin-1"), _fields(text.decode("latin-1"))) if name in wanted else None
        )
    if open_entry is not None:
        yield open_entry


def _fields(text: str) -> list[str]:
    """The fields of one line after its first."""
    if "," in text:
        found = [field.strip() for field in text.split(",")[1:]]
        width = 16 if "*" in text.partition(",")[0] else 8
    else:
        width = 16 if "*" in text[:8] else 8
        text = text.expandtabs(8)
        found = [text[at : at + width].strip() for at in range(8, 8 + width * LINE_FIELDS[width], width)]
    count = LINE_FIELDS[width]
    return (found + [""] * count)[:count]
