"""Drives in, responses out: the CSV tables of predictions."""

import csv
from dataclasses import dataclass
from pathlib import Path

from recordings.columns import Columns
from recordings.errors import InputError
from recordings.whole import whole_file
from twin.arrays import Array
from twin.identify.backbones.modal_prediction import ModalResponse

ROW_LIMIT = 200_000
HELD = ("force_N", "acceleration_m_per_s2")


@dataclass(frozen=True)
class DriveTable:
    """What is asked for, one row a step."""

    frequency_Hz: Array
    """(r,)."""
    force_N: Array | None
    acceleration_m_per_s2: Array | None
    """Peak values; one of the two is given, (r,)."""


def read_drive(path: Path) -> DriveTable:
    """Read a drive: columns ``frequency_Hz`` and either ``force_N`` or ``acceleration_m_per_s2``; others are ignored.

    InputError with line and column, if the file cannot be read or a value is missing or not above zero.
    """
    table = Columns(path, most_rows=ROW_LIMIT)
    given = [name for name in HELD if name in table.names]
    if "frequency_Hz" not in table.names or len(given) != 1:
        raise InputError(path, "line 1", f"needs the column frequency_Hz and one of {', '.join(HELD)}, each once")
    columns = {name: table.numbers(name, above=0) for name in ("frequency_Hz", *given)}
    return DriveTable(columns["frequency_Hz"], columns.get("force_N"), columns.get("acceleration_m_per_s2"))


def write_response(response: ModalResponse, path: Path) -> None:
    """Write one row a solution as CSV; the file appears whole or not at all."""
    names = ("frequency_Hz", "force_N", "acceleration_m_per_s2", "std", "branch", "phase_rad", "stable")
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(names)
        for row in zip(*(getattr(response, name).tolist() for name in names), strict=True):
            writer.writerow([f"{value:.9g}" if isinstance(value, float) else int(value) for value in row])
