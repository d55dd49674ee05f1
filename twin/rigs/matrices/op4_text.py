"""OUTPUT4 files in text: heads of whole numbers, and lines of values in fields of a fixed width."""

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from recordings.errors import InputError
from twin.arrays import Array
from twin.rigs.matrices.numbers import fortran_number
from twin.rigs.matrices.op4_matrix import Op4Matrix, op4_head, string_head

_FORMAT = re.compile(r"\d+[ED](\d+)\.\d+")


class _Lines:
    """The lines of a file, with the number of the last one that was taken."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.number = path, 0
        self._lines = data.decode("latin-1").splitlines()

    def left(self) -> bool:
        while self.number < len(self._lines) and not self._lines[self.number].strip():
            self.number += 1
        return self.number < len(self._lines)

    def take(self) -> str:
        if self.number >= len(self._lines):
            raise InputError(self.path, "", "ends in the middle of a matrix", "export it again")
        self.number += 1
        return self._lines[self.number - 1]

    def integers(self, count: int) -> list[int]:
        words = self.take().split()
        if len(words) != count:
            raise ValueError(f"{len(words)} words where {count} whole numbers are expected")
        return [int(word) for word in words]

    def values(self, width: int) -> Array:
        """All values up to the next line of whole numbers."""
        found = []
        while self.number < len(self._lines) and "." in (line := self._lines[self.number])[:width]:
            self.number += 1
            found += [fortran_number(line[at : at + width]) for at in range(0, len(line.rstrip()), width)]
        return np.array(found)


def text_matrices(path: Path, data: bytes) -> Iterator[Op4Matrix]:
    """All matrices of a file; InputError with the line, if the file is damaged."""
    lines = _Lines(path, data)
    while lines.left():
        try:
            yield _matrix(lines)
        except ValueError as error:
            place = f"line {lines.number}"
            raise InputError(path, place, f"not OUTPUT4: {str(error)[:100]}", "export it again") from error


def _matrix(lines: _Lines) -> Op4Matrix:
    head = lines.take()
    columns, rows, form, kind = (int(head[at : at + 8]) for at in (0, 8, 16, 24))
    matrix = op4_head(columns, rows, form, kind, head[32:40])
    given = _FORMAT.search(head[40:])
    width = int(given[1]) if given else 16  # 1P,5E16.9 where the head does not say it
    if not width:
        raise ValueError("numbers have no width")
    while True:
        column, row, count = lines.integers(3)
        if column > columns:
            lines.values(width)
            return matrix
        if column < 1:
            raise ValueError(f"column {column}")
        if row > 0:
            values = lines.values(width)
            if count not in (len(values), len(values) * matrix.words):
                raise ValueError(f"{len(values)} values in column {column}, which says {count}")
            matrix.strings.append((column - 1, row - 1, values))
            continue
        while count > 0:
            first, length = string_head(matrix, lines.integers(2 if matrix.big else 1))
            values = lines.values(width)
            if len(values) * matrix.words != length:
                raise ValueError(f"{len(values)} values in a string of {length} words")
            matrix.strings.append((column - 1, first, values))
            count -= length + (2 if matrix.big else 1)
