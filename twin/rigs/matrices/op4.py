"""Nastran's OUTPUT4 files, ``.op4``: text, or binary in either order of bytes; its rows have no names."""

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import BinaryIO

import numpy as np
from scipy.sparse import coo_array, csr_array

from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.matrices.found import FoundMatrix, Role, check_shape, from_entries, name_for
from twin.rigs.matrices.numbers import fortran_number

SYMMETRIC = 6
HEAD_BYTES = {24: 4, 48: 8}
"""Length of a matrix's head in binary, four whole numbers and its name in two words, and the bytes of such a word."""
_FORMAT = re.compile(r"\d+[ED](\d+)\.\d+")


@dataclass(frozen=True)
class Op4Matrix:
    """One matrix as it stands in a file: its head and its strings of entries below each other."""

    name: str
    shape: tuple[int, int]
    form: int
    """6 is symmetric."""
    kind: int
    """1 and 2 are real in single and double precision, 3 and 4 complex."""
    big: bool
    """Whether row and length of a string stand in words of their own."""
    words: int
    """Of a real number: half a complex one."""
    strings: list[tuple[int, int, Array]] = field(default_factory=list)
    """Column and first row, from 0, and the values."""

    @staticmethod
    def of(columns: int, rows: int, form: int, kind: int, name: str, *, word_bytes: int = 4) -> "Op4Matrix":
        """From a head; ValueError if it cannot be one.  Negative rows say that strings have words of their own."""
        if not (0 <= columns < 10**9 and abs(rows) < 10**9 and 1 <= kind <= 4):
            raise ValueError(f"{columns} columns, {rows} rows of type {kind} are no matrix")
        words = 2 if kind in (2, 4) and word_bytes == 4 else 1
        return Op4Matrix("".join(name.split()).upper(), (abs(rows), columns), form, kind, rows < 0, words)

    def string_head(self, words: list[int]) -> tuple[int, int]:
        """First row, from 0, and words of a string from the one or two words before it; ValueError if it has none."""
        length, row = (words[0] - 1, words[1]) if self.big else (words[0] // 65536 - 1, words[0] % 65536)
        if length <= 0 or row <= 0 or length % self.words:
            raise ValueError(f"a string of {length} words at row {row}")
        return row - 1, length


def read_op4(path: Path, stream: BinaryIO, role: Role) -> FoundMatrix:
    """The matrix in a file; of several the one that is named like a mass or a stiffness."""
    data = stream.read()
    found: dict[str, Op4Matrix] = {}
    for matrix in op4_matrices(path, data):
        if matrix.name in found:
            raise InputError(path, "", f"holds {matrix.name!r:.20} twice", "write one matrix of a name")
        found[matrix.name] = matrix
    one = found[name_for(path, found, role)]
    check_shape(path, one.shape)
    if one.kind not in (1, 2):
        raise InputError(path, "", f"{one.name} is complex", "needs a real matrix")
    row, column, value = _entries(path, one)
    if one.form == SYMMETRIC:
        return FoundMatrix(from_entries(path, row, column, value, one.shape[0]))
    return FoundMatrix(csr_array(coo_array((value, (row, column)), shape=one.shape)))


def _entries(path: Path, matrix: Op4Matrix) -> tuple[Array, Array, Array]:
    """Rows, columns and values of all that stands in the file."""
    pieces = [(0, 0, np.zeros(0)), *matrix.strings]
    row = np.concatenate([np.arange(first, first + len(values)) for _, first, values in pieces])
    column = np.concatenate([np.full(len(values), column) for column, _, values in pieces])
    value = np.concatenate([values for *_, values in pieces])
    if len(row) and not (row.min() >= 0 and row.max() < matrix.shape[0] and column.max() < matrix.shape[1]):
        reason = f"{matrix.name} has entries outside its {matrix.shape[0]} rows"
        raise InputError(path, "", reason, "export it again")
    kept = value != 0
    return row[kept], column[kept], value[kept]


def op4_matrices(path: Path, data: bytes) -> Iterator[Op4Matrix]:
    """All matrices of a file; InputError with the line or the byte, if the file is damaged."""
    source = (_Binary if b"\0" in data[:24] else _Text)(path, data)
    while source.left():
        try:
            yield _matrix(source)
        except ValueError as error:
            raise InputError(path, source.place, f"not OUTPUT4: {str(error)[:100]}", "export it again") from error


def _matrix(source: "_Text | _Binary") -> Op4Matrix:
    matrix = source.head()
    heads = 2 if matrix.big else 1
    while True:
        column, row, left = source.column()
        if column > matrix.shape[1]:
            source.end()
            return matrix
        if column < 1:
            raise ValueError(f"column {column}")
        while left > 0:
            first, length = (row - 1, left) if row > 0 else matrix.string_head(source.integers(heads))
            values = source.values(length)
            # The count of a whole column is of its words or of its values.
            if length != len(values) * matrix.words and not (row > 0 and length == len(values)):
                raise ValueError(f"{len(values)} values in column {column}, which says {length}")
            matrix.strings.append((column - 1, first, values))
            left -= length + (0 if row > 0 else heads)


class _Text:
    """A file in text: heads of whole numbers, and lines of values in fields of a fixed width."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.number, self._width = path, 0, 16
        self._lines = data.decode("latin-1").splitlines()

    @property
    def place(self) -> str:
        """Of the last line that was taken."""
        return f"line {self.number}"

    def left(self) -> bool:
        while self.number < len(self._lines) and not self._lines[self.number].strip():
            self.number += 1
        return self.number < len(self._lines)

    def _take(self) -> str:
        if self.number >= len(self._lines):
            raise InputError(self.path, "", "ends in the middle of a matrix", "export it again")
        self.number += 1
        return self._lines[self.number - 1]

    def head(self) -> Op4Matrix:
        head = self._take()
        columns, rows, form, kind = (int(head[at : at + 8]) for at in (0, 8, 16, 24))
        given = _FORMAT.search(head[40:])
        self._width = int(given[1]) if given else 16  # 1P,5E16.9 where the head does not say it
        if not self._width:
            raise ValueError("numbers have no width")
        return Op4Matrix.of(columns, rows, form, kind, head[32:40])

    def column(self) -> list[int]:
        return self.integers(3)

    def end(self) -> None:
        self.values(0)

    def integers(self, count: int) -> list[int]:
        words = self._take().split()
        if len(words) != count:
            raise ValueError(f"{len(words)} words where {count} whole numbers are expected")
        return [int(word) for word in words]

    def values(self, length: int) -> Array:
        """All values up to the next line of whole numbers."""
        found = []
        while self.number < len(self._lines) and "." in (line := self._lines[self.number])[: self._width]:
            self.number += 1
            found += [fortran_number(line[at : at + self._width]) for at in range(0, len(line.rstrip()), self._width)]
        return np.array(found)


class _Binary:
    """A file in binary: Fortran records in either order of bytes, each between two words that say its length."""

    def __init__(self, path: Path, data: bytes) -> None:
        self._data, self._at, self._begin, self._record = data, 0, 0, b""
        self._word, self._real, self._columns = 4, "", 0
        self._order = next((o for o in "<>" if int(np.frombuffer(data[:4], f"{o}i4")[0]) in HEAD_BYTES), "")
        if not self._order:
            raise InputError(path, "byte 0", "does not begin like an OUTPUT4 file", "write it again, perhaps as text")

    @property
    def place(self) -> str:
        """Of the matrix."""
        return f"matrix at byte {self._begin}"

    def left(self) -> bool:
        self._begin = self._at
        return self._at < len(self._data)

    def _next(self) -> bytes:
        begin = self._at + 4
        length = self._length(self._at)
        if length < 0 or self._length(begin + length) != length:
            raise ValueError(f"a record says {length} bytes at its beginning, and not at its end")
        self._at = begin + length + 4
        return self._data[begin : begin + length]

    def _length(self, at: int) -> int:
        word = self._data[at : at + 4]
        if len(word) < 4:
            raise ValueError("the file ends in the middle of a matrix")
        return int(np.frombuffer(word, f"{self._order}i4")[0])

    def head(self) -> Op4Matrix:
        head = self._next()
        if len(head) not in HEAD_BYTES:
            raise ValueError(f"a head of {len(head)} bytes")
        word = self._word = HEAD_BYTES[len(head)]
        columns, rows, form, kind = np.frombuffer(head[: 4 * word], f"{self._order}i{word}").tolist()
        name = head[4 * word :].decode("latin-1")
        matrix = Op4Matrix.of(columns, rows, form, kind, name, word_bytes=word)
        self._real, self._columns = f"{self._order}f{word * matrix.words}", columns
        return matrix

    def column(self) -> list[int]:
        self._record = self._next()
        if len(self._record) < 3 * self._word or len(self._record) % self._word:
            raise ValueError(f"a record of {len(self._record)} bytes")
        size = len(self._record)
        column, row, count = self.integers(3)
        if column <= self._columns and size != self._word * (3 + count):
            raise ValueError(f"a record of {size} bytes for {count} words of column {column}")
        return [column, row, count]

    def end(self) -> None:
        self._record = b""

    def integers(self, count: int) -> list[int]:
        return [int(word) for word in np.frombuffer(self._taken(count), f"{self._order}i{self._word}")]

    def values(self, length: int) -> Array:
        return np.frombuffer(self._taken(length), self._real).astype(float)

    def _taken(self, words: int) -> bytes:
        """The next words of the record."""
        size = words * self._word
        if size > len(self._record):
            raise ValueError(f"a string of {words} words reaches beyond its column's record")
        taken, self._record = self._record[:size], self._record[size:]
        return taken
