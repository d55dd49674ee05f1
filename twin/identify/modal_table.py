"""Tables in, tables out, for rigs of kind modal: sweeps to a model, a drive to a response."""

from __future__ import annotations

import csv
from pathlib import Path

import numpy as np

from recordings.errors import InputError
from recordings.tables import SweepTable, read_table
from recordings.whole import whole_file
from twin.identify.backbone import Sweep, identify_backbone
from twin.identify.drive_table import read_drive
from twin.identify.modal_prediction import ModalResponse, predict_forced, predict_held
from twin.rigs.modal import ModalRig

__all__ = ["identify_sweep_table", "predict_drive", "read_sweeps", "write_response"]


def identify_sweep_table(path: Path, rig: ModalRig) -> ModalRig:
    """The modal model of a CSV table of response-controlled sweeps (columns as :func:`recordings.tables.read_table`).

    Raises
    ------
    InputError
        If the table holds no sweeps, too few of them, or a force of zero.
    """
    sweeps = sorted(read_sweeps(path), key=lambda sweep: sweep.amplitude)
    try:
        return identify_backbone(sweeps, name=rig.name, source=rig.source, channel=rig.channel)
    except ValueError as error:
        raise InputError(path, "", str(error)) from error


def read_sweeps(path: Path) -> list[Sweep]:
    """Sweeps of a CSV table in the order of the file, responses turned into accelerations.

    Raises
    ------
    InputError
        If the table holds no sweeps, or a force or response of zero.
    """
    table = read_table(path)
    if not isinstance(table, SweepTable):
        raise InputError(path, "", "holds natural frequencies, a modal rig needs sweeps")
    if np.any(table.force_N <= 0) or np.any(table.response <= 0):
        line = int(table.line[np.argmax((table.force_N <= 0) | (table.response <= 0))])
        raise InputError(path, f"line {line}", "force and response must be above zero")
    power = {"acceleration": 0, "velocity": 1, "displacement": 2}[table.quantity]
    acceleration = table.response * (2 * np.pi * table.frequency_Hz) ** power
    return [
        Sweep(f"{level:g}", table.frequency_Hz[rows], table.force_N[rows], acceleration[rows], table.phase_rad[rows])
        for level, rows in table.sweeps().items()
    ]


def predict_drive(model: ModalRig, path: Path, *, source: str | Path = "model") -> ModalResponse:
    """The response to a drive table: columns ``frequency_Hz`` and ``force_N`` or ``acceleration_m_per_s2``.

    Raises
    ------
    InputError
        If the model was not identified yet (`source` names its file), or the table is not such a drive.
    """
    if model.law is None:
        raise InputError(source, "law", "this modal rig has none yet", "identify it from sweeps first")
    drive = read_drive(path)
    if drive.force_N is not None:
        return predict_forced(model.law, drive.frequency_Hz, drive.force_N)
    assert drive.acceleration_m_per_s2 is not None
    return predict_held(model.law, drive.frequency_Hz, drive.acceleration_m_per_s2)


def write_response(response: ModalResponse, path: Path) -> None:
    """Write one row a solution as CSV; the file appears whole or not at all."""
    names = ("frequency_Hz", "force_N", "acceleration_m_per_s2", "std", "branch", "phase_rad", "stable")
    with whole_file(path) as part, part.open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(names)
        for row in zip(*(getattr(response, name).tolist() for name in names), strict=True):
            writer.writerow([f"{value:.9g}" if isinstance(value, float) else int(value) for value in row])
