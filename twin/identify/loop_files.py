"""Files of force-displacement loops: CSV in SI units, or the friction damper's tables in inches and kips."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from recordings.errors import InputError
from twin.identify.friction_loops import INCH, KIP, SIZE_LIMIT_BYTES, Loop, read_damper_json

__all__ = ["read_loop"]

COLUMNS = {"displacement_m": 1.0, "displacement_inch": INCH}, {"force_N": 1.0, "friction_kip": KIP}
FEWEST_ROWS = 100
UNEVEN = 0.01
"""Largest deviation of a time step from the mean one, as a share of it."""


def read_loop(path: Path) -> Loop:
    """A loop under its file's name.

    A CSV file has the columns ``time_s`` in equal steps, ``displacement_m`` (or ``displacement_inch``) and ``force_N``
    (or ``friction_kip``); other columns are ignored.  A JSON file is one of the ARTS laboratory's.

    Raises
    ------
    InputError
        If the file is neither.
    """
    if path.suffix.lower() == ".json":
        return read_damper_json(path)
    try:
        if path.stat().st_size > SIZE_LIMIT_BYTES:
            raise InputError(path, "", f"larger than {SIZE_LIMIT_BYTES} bytes")
        with path.open(encoding="utf-8", newline="") as stream:
            rows = list(csv.reader(stream))
    except OSError as error:
        raise InputError(path, "", (error.strerror or str(error)).lower()) from error
    except (ValueError, csv.Error) as error:
        raise InputError(path, "", f"is no CSV text: {error}") from error
    if len(rows) <= FEWEST_ROWS:
        raise InputError(path, "", f"needs a line of column names and at least {FEWEST_ROWS} rows")
    names = [name.strip() for name in rows[0]]
    places = [_column(path, names, {"time_s": 1.0}), *(_column(path, names, known) for known in COLUMNS)]
    values = np.zeros((len(rows) - 1, 3))
    for line, row in enumerate(rows[1:], 2):
        for k, (column, factor) in enumerate(places):
            try:
                values[line - 2, k] = factor * float(row[column])
            except (ValueError, IndexError) as error:
                raise InputError(path, f"line {line}", f"column {names[column]!r} has no number") from error
    if not np.isfinite(values).all():
        raise InputError(path, f"line {2 + int(np.argmin(np.isfinite(values).all(axis=1)))}", "is not finite")
    step = np.diff(values[:, 0])
    if step.mean() <= 0 or np.max(np.abs(step - step.mean())) > UNEVEN * step.mean():
        raise InputError(path, "column time_s", "does not rise in equal steps")
    return Loop(path.stem, float(1 / step.mean()), values[:, 1], values[:, 2])


def _column(path: Path, names: list[str], known: dict[str, float]) -> tuple[int, float]:
    for name, factor in known.items():
        if name in names:
            return names.index(name), factor
    raise InputError(path, "line 1", f"has no column {' or '.join(known)}", f"it has {', '.join(names)[:120]}")
