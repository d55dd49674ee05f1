"""Diagnosis of tables: natural frequencies, or sweeps that held their response."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

from recordings import FrequencyTable, InputError, read_table
from twin.diagnose.tables import TableDiagnosis, diagnose_frequencies, diagnose_sweeps
from twin.identify.backbone import BackboneSweep
from twin.identify.modal_table import read_sweeps
from twin.rigs import Rig
from twin.rigs.kinds import AnyRig
from twin.rigs.modal import ModalRig


def diagnose_tables(
    runs: Sequence[Path],
    held_out: Sequence[Path],
    rig: AnyRig,
    *,
    source: str,
    preloads: Sequence[str],
    report: Callable[[str], None],
) -> TableDiagnosis:
    """Diagnose tables of one kind.

    Raises
    ------
    InputError
        If the tables, the rig or the preloads are wrong, or do not fit together.
    """
    # Told apart by their columns; sweeps are read again by kind, which costs little.
    tables = {path: read_table(path) for path in [*runs, *held_out]}
    kinds = [isinstance(table, FrequencyTable) for table in tables.values()]
    if any(kinds) and not all(kinds):
        odd = list(tables)[kinds.index(not kinds[0])]
        kind = "sweeps" if kinds[0] else "natural frequencies"
        raise InputError(odd, "", f"holds {kind}, {runs[0]} does not", "diagnose them by themselves")
    if not all(kinds):
        return _sweeps(runs, held_out, rig, preloads)
    if isinstance(rig, ModalRig):
        raise InputError(
            source,
            "kind",
            "is a rig of one mode, without a structure",
            "natural frequencies need a rig of parts",
        )
    frequencies = {path: table for path, table in tables.items() if isinstance(table, FrequencyTable)}
    return diagnose_frequencies(
        [frequencies[path] for path in runs], rig, preloads=preloads,
        held_out=[frequencies[path] for path in held_out], source=source, report=report,
    )  # fmt: skip


def _sweeps(runs: Sequence[Path], held_out: Sequence[Path], rig: AnyRig, preloads: Sequence[str]) -> TableDiagnosis:
    if preloads:
        raise InputError("--preload", "", "a table of sweeps is diagnosed without a joint's model", "leave it out")
    channel, source = "acc1", ""
    if isinstance(rig, ModalRig):
        channel, source = rig.channel, rig.source
    elif isinstance(rig, Rig) and rig.response_sensors:
        channel = rig.response_sensors[-1].channel
    path = runs[0] if len(runs) == 1 else Path(" ".join(map(str, runs)))
    return diagnose_sweeps(
        _read(runs), path=path, rig_name=rig.name, held_out=_read(held_out), held_out_paths=held_out, channel=channel,
        source=source,
    )  # fmt: skip


def _read(paths: Sequence[Path]) -> list[BackboneSweep]:
    """Sweeps of all tables; named after their table where there are several."""
    if len(paths) == 1:
        return read_sweeps(paths[0])
    return [replace(sweep, level=f"{path.stem}:{sweep.level}") for path in paths for sweep in read_sweeps(path)]
