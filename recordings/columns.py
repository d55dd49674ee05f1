"""Columns of CSV files that people made, checked value by value."""

import csv
import math
from pathlib import Path
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError, reason_of
from recordings.reader import open_input

SIZE_LIMIT_BYTES = 64 << 20
MOST_ROWS = 10_000_000
LARGEST_NUMBER = 10**15
"""Of whole numbers; far below where floating-point numbers miss integers."""


class Columns:
    """Values of a CSV file by column; errors name line and column.

    Parameters
    ----------
    needed
        Columns without which the file is refused; others may be there.
    most_rows
        Below the column names.

    Raises
    ------
    InputError
        If the file cannot be read, is no table, or has not these columns once each, or not so many rows.
    """

    def __init__(self, path: str | Path, *needed: str, most_rows: int = MOST_ROWS) -> None:
        self.path = Path(path)
        rows = _csv_rows(self.path)
        if not rows:
            raise InputError(path, "", "is empty", "it needs column names, and rows below them")
        (head, names), self._rows = rows[0], rows[1:]
        self.names = [name.strip() for name in names]
        self.need(*needed)
        if doubled := sorted({name for name in self.names if name and self.names.count(name) > 1}):
            raise InputError(path, f"line {head}", f"column {doubled[0]!r:.60} stands twice")
        if not 1 <= len(self._rows) <= most_rows:
            reason = f"has {len(self._rows)} rows below the column names"
            raise InputError(path, "", reason, f"1 to {most_rows} are allowed")
        for line, row in self._rows:
            if len(row) != len(names):
                raise InputError(path, f"line {line}", f"has {len(row)} values for {len(names)} columns")
        self.line = np.array([line for line, _ in self._rows], dtype=np.int64)
        """Of the file, where each row stands."""

    def __len__(self) -> int:
        return len(self._rows)

    def need(self, *names: str) -> None:
        """Refuse a table without these columns."""
        for name in names:
            if name not in self.names:
                listed = ", ".join(map(repr, self.names))[:120]
                raise InputError(self.path, "line 1", f"no column {name!r}", f"the columns are {listed}")

    def numbers(self, name: str, *, least: float = -math.inf, above: float = -math.inf) -> NDArray[np.float64]:
        """One column; every value finite, at least `least` and greater than `above`."""
        at, values = self.names.index(name), np.empty(len(self))
        for i, (_, row) in enumerate(self._rows):
            try:
                values[i] = float(row[at])
            except ValueError:
                values[i] = math.nan
        self.check(np.isfinite(values), name, "is not a number")
        self.check((values >= least) & (values > above), name, "is negative" if above < 0 else "is not above zero")
        return values

    def integers(self, name: str) -> NDArray[np.int64]:
        """One column of whole numbers from 0 up."""
        values = self.numbers(name)
        whole = (values >= 0) & (values <= LARGEST_NUMBER) & (values == np.floor(values))
        self.check(whole, name, "is not a whole number from 0 up")
        return values.astype(np.int64)

    def optional(self, name: str, *, least: float = -math.inf) -> NDArray[np.float64]:
        """One column of numbers, or NaN if the table does not have it."""
        return self.numbers(name, least=least) if name in self.names else np.full(len(self), np.nan)

    def texts(self, name: str) -> tuple[str, ...]:
        """One column as it stands, or empty texts if the table does not have it."""
        if name not in self.names:
            return ("",) * len(self)
        at = self.names.index(name)
        texts = tuple(row[at].strip() for _, row in self._rows)
        self.check(np.array([0 < len(text) <= 64 for text in texts]), name, "is not a name of 1 to 64 characters")
        return texts

    def check(self, good: NDArray[Any], name: str, reason: str, remedy: str = "") -> None:
        """Refuse the first value that is not good."""
        if not np.all(good):
            row = int(np.argmin(good))
            self.refuse(row, name, f"{self._rows[row][1][self.names.index(name)].strip()!r:.60} {reason}", remedy)

    def refuse(self, row: int, name: str, reason: str, remedy: str = "") -> NoReturn:
        """Raise with the place of a row's value."""
        raise InputError(self.path, f"line {self.line[row]}, column {name}", reason, remedy)


def _csv_rows(path: Path) -> list[tuple[int, list[str]]]:
    """Rows of a CSV file with their lines; empty lines and those that begin with # are left out.

    Raises
    ------
    InputError
        If it cannot be read, or is too large or no CSV text.
    """
    with open_input(path) as stream:
        try:
            data = stream.read(SIZE_LIMIT_BYTES + 1)
        except OSError as error:
            raise InputError(path, "", f"cannot read: {reason_of(error)}") from error
    if len(data) > SIZE_LIMIT_BYTES:
        raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes, the limit for tables")
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(path, f"byte {error.start}", "not UTF-8 text") from error
    reader = csv.reader(text.splitlines(keepends=True), strict=True)
    rows = []
    try:
        for row in reader:
            if any(value.strip() for value in row) and not row[0].lstrip().startswith("#"):
                rows.append((reader.line_num, row))
    except csv.Error as error:
        raise InputError(path, f"line {reader.line_num}", f"not CSV: {error}") from error
    return rows
