"""One matrix of an OUTPUT4 file as it stands there, text or binary."""

from dataclasses import dataclass, field

from twin.arrays import Array

SYMMETRIC = 6


@dataclass(frozen=True)
class Op4Matrix:
    """Its head and its strings of entries below each other."""

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


def op4_head(columns: int, rows: int, form: int, kind: int, name: str, *, word_bytes: int = 4) -> Op4Matrix:
    """A matrix's head; ValueError if it cannot be one.  Negative rows say that strings have words of their own."""
    if not (0 <= columns < 10**9 and abs(rows) < 10**9 and 1 <= kind <= 4):
        raise ValueError(f"{columns} columns, {rows} rows of type {kind} are no matrix")
    words = 2 if kind in (2, 4) and word_bytes == 4 else 1
    return Op4Matrix("".join(name.split()).upper(), (abs(rows), columns), form, kind, rows < 0, words)


def string_head(matrix: Op4Matrix, words: list[int]) -> tuple[int, int]:
    """First row, from 0, and words of a string from the one or two words before it; ValueError if it has none."""
    length, row = (words[0] - 1, words[1]) if matrix.big else (words[0] // 65536 - 1, words[0] % 65536)
    if length <= 0 or row <= 0 or length % matrix.words:
        raise ValueError(f"a string of {length} words at row {row}")
    return row - 1, length
