"""Drives in, responses out: the CSV tables of predictions."""

from __future__ import annotations

import csv
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError
from recordings.reader import open_input

__all__ = ["DriveTable", "read_drive"]

Array = NDArray[np.float64]

SIZE_LIMIT_BYTES = 32 << 20
ROW_LIMIT = 200_000
HELD = ("force_N", "acceleration_m_per_s2")


@dataclass(frozen=True)
class DriveTable:
    """What is asked for, one row a step.

    Attributes
    ----------
    frequency_Hz : ndarray, (r,)
    force_N, acceleration_m_per_s2 : ndarray, (r,), or None
        Peak values; one of the two is given.
    """

    frequency_Hz: Array
    force_N: Array | None
    acceleration_m_per_s2: Array | None


def read_drive(path: Path) -> DriveTable:
    """Read a drive: columns ``frequency_Hz`` and either ``force_N`` or ``acceleration_m_per_s2``; others are ignored.

    Raises
    ------
    InputError
        With line and column, if the file cannot be read or a value is missing or not above zero.
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
    rows: list[tuple[int, list[str]]] = []
    try:
        for row in reader:
            if any(value.strip() for value in row) and not row[0].lstrip().startswith("#"):
                rows.append((reader.line_num, row))
    except csv.Error as error:
        raise InputError(path, f"line {reader.line_num}", f"not CSV: {error}") from error
    if not rows:
        raise InputError(path, "", "is empty", "it needs column names and rows of numbers")
    if not 1 <= len(rows) - 1 <= ROW_LIMIT:
        raise InputError(path, "", f"has {len(rows) - 1} rows below the column names", f"1 to {ROW_LIMIT} are allowed")
    names = [name.strip() for name in rows[0][1]]
    given = [name for name in HELD if name in names]
    if "frequency_Hz" not in names or len(given) != 1 or len(set(names)) != len(names):
        raise InputError(
            path, f"line {rows[0][0]}", f"needs the column frequency_Hz and one of {', '.join(HELD)}, each once"
        )
    columns = {name: _column(path, name, names.index(name), len(names), rows[1:]) for name in ("frequency_Hz", *given)}
    return DriveTable(columns["frequency_Hz"], columns.get("force_N"), columns.get("acceleration_m_per_s2"))


def _column(path: Path, name: str, at: int, width: int, rows: list[tuple[int, list[str]]]) -> Array:
    values = np.empty(len(rows))
    for i, (line, row) in enumerate(rows):
        if len(row) != width:
            raise InputError(path, f"line {line}", f"has {len(row)} values for {width} columns")
        try:
            values[i] = float(row[at])
        except ValueError as error:
            raise InputError(path, f"line {line}, column {name}", f"{row[at]!r:.60} is not a number") from error
        if not 0 < values[i] < np.inf:
            raise InputError(path, f"line {line}, column {name}", f"{row[at]!r:.60} is not above zero")
    return values
