"""OUTPUT4 files in binary: Fortran records in either order of bytes."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from recordings.errors import InputError
from twin.rigs.matrices.op4_matrix import Op4Matrix, op4_head, string_head

HEAD_BYTES = {24: 4, 48: 8}
"""Length of a matrix's head, four whole numbers and its name in two words, and the bytes of such a word."""


class _Records:
    """Records of a file, each between two words that say its length."""

    def __init__(self, path: Path, data: bytes) -> None:
        self.path, self.data, self.at = path, data, 0
        self.order = next((o for o in "<>" if int(np.frombuffer(data[:4], f"{o}i4")[0]) in HEAD_BYTES), "")
        if not self.order:
            raise InputError(path, "byte 0", "does not begin like an OUTPUT4 file", "write it again, perhaps as text")

    def next(self) -> bytes:
        begin = self.at + 4
        length = self._word(self.at)
        if length < 0 or self._word(begin + length) != length:
            raise ValueError(f"a record says {length} bytes at its beginning, and not at its end")
        self.at = begin + length + 4
        return self.data[begin : begin + length]

    def _word(self, at: int) -> int:
        word = self.data[at : at + 4]
        if len(word) < 4:
            raise ValueError("the file ends in the middle of a matrix")
        return int(np.frombuffer(word, f"{self.order}i4")[0])


def binary_matrices(path: Path, data: bytes) -> Iterator[Op4Matrix]:
    """All matrices of a file; InputError with the byte, if the file is damaged."""
    records = _Records(path, data)
    while records.at < len(data):
        begin = records.at
        try:
            yield _matrix(records)
        except ValueError as error:
            place = f"matrix at byte {begin}"
            raise InputError(path, place, f"not OUTPUT4: {str(error)[:100]}", "export it again") from error


def _matrix(records: _Records) -> Op4Matrix:
    head = records.next()
    if len(head) not in HEAD_BYTES:
        raise ValueError(f"a head of {len(head)} bytes")
    word = HEAD_BYTES[len(head)]
    integer = f"{records.order}i{word}"
    columns, rows, form, kind = np.frombuffer(head[: 4 * word], integer).tolist()
    matrix = op4_head(columns, rows, form, kind, head[4 * word :].decode("latin-1"), word_bytes=word)
    real = f"{records.order}f{word * matrix.words}"
    while True:
        record = records.next()
        if len(record) < 3 * word or len(record) % word:
            raise ValueError(f"a record of {len(record)} bytes")
        column, row, count = np.frombuffer(record[: 3 * word], integer).tolist()
        if column > columns:
            return matrix
        if column < 1 or len(record) != word * (3 + count):
            raise ValueError(f"a record of {len(record)} bytes for {count} words of column {column}")
        if row > 0:
            matrix.strings.append((column - 1, row - 1, np.frombuffer(record[3 * word :], real).astype(float)))
            continue
        at = 3 * word
        while at < len(record):
            begin = at + word * (2 if matrix.big else 1)
            first, length = string_head(matrix, np.frombuffer(record[at:begin], integer).tolist())
            at = begin + word * length
            if at > len(record):
                raise ValueError(f"a string of {length} words reaches beyond its column's record")
            matrix.strings.append((column - 1, first, np.frombuffer(record[begin:at], real).astype(float)))
