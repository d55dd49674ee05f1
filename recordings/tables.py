"""Tables of measured sweeps and of natural frequencies in CSV, checked line by line."""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NoReturn

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from recordings.quantities import QUANTITIES
from recordings.reader import open_input

__all__ = ["FrequencyTable", "SweepTable", "csv_rows", "read_table"]

SIZE_LIMIT_BYTES = 64 << 20
RESPONSES = {one.column: one.name for one in QUANTITIES if one.column}
"""Columns a response may stand in, and the quantity each means."""


@dataclass(frozen=True, kw_only=True)
class SweepTable:
    """Stepped-sine sweeps as amplitudes, one row a step, in the order of the file.

    Parameters
    ----------
    path
        Where it was read.
    quantity
        What `response` is.
    level
        Which sweep a row belongs to: rows of one level are one sweep.
    frequency_Hz
        Excitation frequency, above zero.
    force_N, response
        Peak values of force and of response (m/s^2, m/s or m), not negative.
    phase_rad
        Of the response against the force; NaN where the table has none.
    line
        Line of the file that a row stands on, for messages.
    """

    path: str
    quantity: str
    level: NDArray[np.float64]
    frequency_Hz: NDArray[np.float64]
    force_N: NDArray[np.float64]
    response: NDArray[np.float64]
    phase_rad: NDArray[np.float64]
    line: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.level)

    def sweeps(self) -> dict[float, NDArray[np.intp]]:
        """Rows of each level, levels in the order of their first rows."""
        return {level: np.flatnonzero(self.level == level) for level in dict.fromkeys(self.level.tolist())}


@dataclass(frozen=True, kw_only=True)
class FrequencyTable:
    """Measured natural frequencies; `std_Hz` is NaN, and `preload` empty, where the table has none."""

    path: str
    mode: NDArray[np.int64]
    frequency_Hz: NDArray[np.float64]
    std_Hz: NDArray[np.float64]
    preload: tuple[str, ...]
    line: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.mode)


def read_table(path: str | Path) -> SweepTable | FrequencyTable:
    """Read a CSV file of sweeps or of natural frequencies, told apart by its columns.

    Sweeps have the columns ``level``, ``frequency_Hz``, ``force_N``, one of ``acceleration_m_per_s2``,
    ``velocity_m_per_s``, ``displacement_m``, and may have ``phase_rad``; natural frequencies have ``mode``,
    ``frequency_Hz`` and may have ``std_Hz``, and ``preload`` where a table holds several states of a joint.  Other
    columns are ignored.

    Raises
    ------
    InputError
        With line and column, if the file cannot be read or a value is missing or impossible.
    """
    path = Path(path)
    rows = csv_rows(path)
    if not rows:
        raise InputError(path, "", "is empty")
    line, names = rows[0]
    columns = [name.strip() for name in names]
    if doubled := sorted({name for name in columns if name and columns.count(name) > 1}):
        raise InputError(path, f"line {line}", f"column {doubled[0]!r:.60} stands twice")
    if len(rows) == 1:
        raise InputError(path, f"line {line}", "has no rows below the column names")
    if "mode" in columns:
        return _frequencies(_Columns(path, columns, rows[1:]))
    return _sweeps(_Columns(path, columns, rows[1:]))


class _Columns:
    """Values of a table by column, errors with their place."""

    def __init__(self, path: Path, names: Sequence[str], rows: Sequence[tuple[int, list[str]]]) -> None:
        self.path, self.names, self._rows = path, names, rows
        for line, row in rows:
            if len(row) != len(names):
                raise InputError(path, f"line {line}", f"has {len(row)} values for {len(names)} columns")
        self.line = np.array([line for line, _ in rows], dtype=np.int64)

    def need(self, *names: str) -> None:
        """Refuse a table without these columns."""
        for name in names:
            if name not in self.names:
                listed = ", ".join(map(repr, self.names))[:120]
                raise InputError(self.path, "line 1", f"no column {name!r}", f"the columns are {listed}")

    def numbers(self, name: str, *, least: float = -math.inf, above: float = -math.inf) -> NDArray[np.float64]:
        """One column; every value finite, at least `least` and greater than `above`."""
        at = self.names.index(name)
        values = np.empty(len(self._rows))
        for index, (line, row) in enumerate(self._rows):
            try:
                value = float(row[at])
            except ValueError:
                value = math.nan
            if not math.isfinite(value):
                self.refuse(line, name, f"{row[at]!r:.60} is not a number")
            if value < least or value <= above:
                self.refuse(line, name, f"{row[at]!r:.60} is {'negative' if above < 0 else 'not above zero'}")
            values[index] = value
        return values

    def optional(self, name: str, *, least: float = -math.inf) -> NDArray[np.float64]:
        """One column, or NaN if the table does not have it."""
        return self.numbers(name, least=least) if name in self.names else np.full(len(self._rows), np.nan)

    def texts(self, name: str) -> tuple[str, ...]:
        """One column as it stands, or empty texts if the table does not have it."""
        if name not in self.names:
            return ("",) * len(self._rows)
        at = self.names.index(name)
        for line, row in self._rows:
            if not 0 < len(row[at].strip()) <= 64:
                self.refuse(line, name, f"{row[at]!r:.60} is not a name of 1 to 64 characters")
        return tuple(row[at].strip() for _, row in self._rows)

    def refuse(self, line: int, column: str, reason: str) -> NoReturn:
        """Raise with the place."""
        raise InputError(self.path, f"line {line}, column {column}", reason)


def _sweeps(table: _Columns) -> SweepTable:
    table.need("level", "frequency_Hz", "force_N")
    responses = [name for name in RESPONSES if name in table.names]
    if len(responses) != 1:
        found = f"{len(responses)} of the columns" if responses else "none of the columns"
        raise InputError(table.path, "line 1", f"{found} {', '.join(RESPONSES)}; one is needed")
    return SweepTable(
        path=str(table.path), quantity=RESPONSES[responses[0]], level=table.numbers("level"),
        frequency_Hz=table.numbers("frequency_Hz", above=0), force_N=table.numbers("force_N", least=0),
        response=table.numbers(responses[0], least=0), phase_rad=table.optional("phase_rad"), line=table.line,
    )  # fmt: skip


def _frequencies(table: _Columns) -> FrequencyTable:
    table.need("mode", "frequency_Hz")
    modes, preload = table.numbers("mode", above=0), table.texts("preload")
    seen: set[tuple[str, float]] = set()
    for line, state, mode in zip(table.line.tolist(), preload, modes.tolist(), strict=True):
        if mode != int(mode) or mode > 10_000:
            table.refuse(line, "mode", f"{mode:g} is not the number of a mode")
        if (state, mode) in seen:
            table.refuse(line, "mode", f"mode {mode:g} stands twice" + (f" at preload {state}" if state else ""))
        seen.add((state, mode))
    return FrequencyTable(
        path=str(table.path), mode=modes.astype(np.int64), frequency_Hz=table.numbers("frequency_Hz", above=0),
        std_Hz=table.optional("std_Hz", least=0), preload=preload, line=table.line,
    )  # fmt: skip


def csv_rows(path: Path) -> list[tuple[int, list[str]]]:
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
            raise InputError(path, "", f"cannot read: {(error.strerror or str(error)).lower()}") from error
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
