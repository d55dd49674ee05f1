"""Tables of measured sweeps and of natural frequencies in CSV, checked line by line."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from recordings.columns import Columns
from recordings.errors import InputError
from recordings.quantities import QUANTITIES

RESPONSES = {one.column: one.name for one in QUANTITIES if one.column}
"""Columns a response may stand in, and the quantity each means."""


@dataclass(frozen=True, kw_only=True)
class SweepTable:
    """Stepped-sine sweeps as amplitudes, one row a step, in the order of the file."""

    path: str
    """Where it was read."""
    quantity: str
    """What `response` is."""
    level: NDArray[np.float64]
    """Which sweep a row belongs to: rows of one level are one sweep."""
    frequency_Hz: NDArray[np.float64]
    """Excitation frequency, above zero."""
    force_N: NDArray[np.float64]
    response: NDArray[np.float64]
    """Peak values of force and of response (m/s^2, m/s or m), not negative."""
    phase_rad: NDArray[np.float64]
    """Of the response against the force; NaN where the table has none."""
    line: NDArray[np.int64]
    """Line of the file that a row stands on, for messages."""

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
    table = Columns(path)
    return _frequencies(table) if "mode" in table.names else _sweeps(table)


def _sweeps(table: Columns) -> SweepTable:
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


def _frequencies(table: Columns) -> FrequencyTable:
    table.need("mode", "frequency_Hz")
    modes, preload = table.numbers("mode", above=0), table.texts("preload")
    seen: set[tuple[str, float]] = set()
    for row, (state, mode) in enumerate(zip(preload, modes.tolist(), strict=True)):
        if mode != int(mode) or mode > 10_000:
            table.refuse(row, "mode", f"{mode:g} is not the number of a mode")
        if (state, mode) in seen:
            table.refuse(row, "mode", f"mode {mode:g} stands twice" + (f" at preload {state}" if state else ""))
        seen.add((state, mode))
    return FrequencyTable(
        path=str(table.path), mode=modes.astype(np.int64), frequency_Hz=table.numbers("frequency_Hz", above=0),
        std_Hz=table.optional("std_Hz", least=0), preload=preload, line=table.line,
    )  # fmt: skip
