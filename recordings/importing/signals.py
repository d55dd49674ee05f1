"""What a foreign file holds before anybody knows what it means: columns of numbers with what the file says of them."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from recordings.errors import InputError

MOST_VALUES = 1 << 27
"""Of one file, all columns together: 1 GiB as they are read; an hour of four channels at 9 kHz."""
MOST_COLUMNS = 1024


@dataclass(frozen=True, kw_only=True)
class Signal:
    """One column."""

    name: str
    """As the file has it, without the unit."""
    values: NDArray[np.float64] | NDArray[np.datetime64]
    """Numbers, or times, (n,)."""
    table: str
    """Signals of one table were sampled together."""
    unit: str = ""
    """As the file has it; empty if it does not say."""
    sample_rate_Hz: float | None = None
    start_ns: int | None = None
    position_m: float | None = None
    direction: str = "+y"
    """Where the file says them: rate, time of the first sample since 1970, and what a recording has of a channel."""


def check_size(path: Path, place: str, values: int, columns: int = 1) -> None:
    """Refuse what would not fit, before it is read; raises InputError."""
    if columns > MOST_COLUMNS:
        raise InputError(path, place, f"has {columns} columns", f"up to {MOST_COLUMNS} are read")
    if values > MOST_VALUES:
        raise InputError(path, place, f"claims {values} values", f"up to {MOST_VALUES} are read; cut it into pieces")


def columns_of(name: str, array: NDArray[np.generic]) -> list[tuple[str, NDArray[np.float64]]]:
    """The columns of an array with their names: one of a vector, each of a matrix that has fewer columns than rows.

    Empty for what is no such array of real numbers, or has fewer than two rows.
    """
    if array.dtype.kind not in "iuf" or array.ndim not in (1, 2):
        return []
    table = array[:, None] if array.ndim == 1 else array.T if array.shape[0] < array.shape[1] else array
    if len(table) < 2:
        return []
    columns = np.asarray(table, dtype=np.float64).T
    return [(name if len(columns) == 1 else f"{name}_{at}", each) for at, each in enumerate(columns, start=1)]
