"""A table of sweeps to the model of a rig of kind modal."""

from pathlib import Path

import numpy as np

from recordings.errors import InputError, blamed_on
from recordings.quantities import quantity
from recordings.tables import SweepTable, read_table
from twin.identify.backbones.backbone import BackboneSweep, identify_backbone
from twin.rigs.modal import ModalRig


def identify_sweep_table(path: Path, rig: ModalRig) -> ModalRig:
    """The modal model of a CSV table of response-controlled sweeps (columns as :func:`recordings.tables.read_table`).

    InputError if the table holds no sweeps, too few of them, or a force of zero, or no model fits them.
    """
    sweeps = sorted(read_sweeps(path), key=lambda sweep: sweep.amplitude)
    with blamed_on(path, of=(ValueError, ArithmeticError)):
        return identify_backbone(sweeps, name=rig.name, source=rig.source, channel=rig.channel)


def read_sweeps(path: Path) -> list[BackboneSweep]:
    """Sweeps of a CSV table in the order of the file, responses turned into accelerations.

    InputError if the table holds no sweeps, or a force or response of zero.
    """
    table = read_table(path)
    if not isinstance(table, SweepTable):
        raise InputError(path, "", "holds natural frequencies, a modal rig needs sweeps")
    if np.any(table.force_N <= 0) or np.any(table.response <= 0):
        line = int(table.line[np.argmax((table.force_N <= 0) | (table.response <= 0))])
        raise InputError(path, f"line {line}", "force and response must be above zero")
    power = 2 - quantity(table.quantity).derivative
    acceleration = table.response * (2 * np.pi * table.frequency_Hz) ** power
    return [
        BackboneSweep(
            f"{level:g}", table.frequency_Hz[rows], table.force_N[rows], acceleration[rows], table.phase_rad[rows]
        )
        for level, rows in table.sweeps().items()
    ]
