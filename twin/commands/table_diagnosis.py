"""Tables as RUNs of ``twin diagnose``: natural frequencies, or sweeps that held their response."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from recordings.errors import InputError
from twin.commands.output import working

if TYPE_CHECKING:
    from twin.diagnose.tables import TableDiagnosis
    from twin.identify.backbone import Sweep

__all__ = ["EXTENDED", "diagnose_tables"]

EXTENDED = "extended.toml"
USUAL_s = 10.0
"""What the diagnosis of a table takes on two cores."""


def diagnose_tables(
    runs: Sequence[Path],
    held_out: Sequence[Path],
    rig_name: str,
    preloads: Sequence[str],
    report: Path,
    again: str,
) -> dict[str, Any]:
    """Diagnose tables, write the report and, beside it, the extended model; the contract's JSON object.

    Raises
    ------
    InputError
        If the tables, the rig or the preloads are wrong, or do not fit together.
    """
    from recordings import FrequencyTable, read_table
    from twin.views.table_report import write_table_report

    _check_rig(rig_name)
    # Told apart by their columns; the tables themselves are read again by kind, which costs little.
    tables = {path: read_table(path) for path in [*runs, *held_out]}
    frequencies = [isinstance(table, FrequencyTable) for table in tables.values()]
    if any(frequencies) and not all(frequencies):
        odd = list(tables)[frequencies.index(not frequencies[0])]
        kind = "sweeps" if frequencies[0] else "natural frequencies"
        raise InputError(odd, "", f"holds {kind}, {runs[0]} does not", "diagnose them by themselves")
    with working("starting", usual_s=USUAL_s) as say:
        if all(frequencies):
            result = _frequencies(tables, runs, held_out, rig_name, preloads, say)
        else:
            result = _sweeps(runs, held_out, rig_name, preloads)
        say("writing the report")
        write_table_report(result, report, commands=[again])
        _save(result, report.with_name(EXTENDED))
    return result.to_dict(EXTENDED)


def _check_rig(rig_name: str) -> None:
    from twin.rigs import RIG_FILES
    from twin.rigs.beam import BEAM_RIG_FILES
    from twin.rigs.modal import MODAL_RIG_FILES

    shipped = [*RIG_FILES, *BEAM_RIG_FILES, *MODAL_RIG_FILES]
    if rig_name not in shipped and not Path(rig_name).exists():
        raise InputError(rig_name, "", "neither a file nor a shipped rig", f"shipped rigs: {', '.join(shipped)}")


def _frequencies(
    tables: dict[Path, Any],
    runs: Sequence[Path],
    held_out: Sequence[Path],
    rig_name: str,
    preloads: Sequence[str],
    report: Any,
) -> TableDiagnosis:
    from twin.diagnose.tables import diagnose_frequencies
    from twin.rigs import load_rig
    from twin.rigs.beam import is_beam_rig, load_beam_rig
    from twin.rigs.modal import is_modal_rig

    if is_modal_rig(rig_name):
        raise InputError(
            rig_name,
            "kind",
            "is a rig of one mode, without a structure",
            "natural frequencies need a lap joint or a beam",
        )
    rig = load_beam_rig(rig_name) if is_beam_rig(rig_name) else load_rig(rig_name)
    return diagnose_frequencies(
        [tables[path] for path in runs], rig, preloads=preloads, held_out=[tables[path] for path in held_out],
        source=rig_name, report=report,
    )  # fmt: skip


def _sweeps(runs: Sequence[Path], held_out: Sequence[Path], rig_name: str, preloads: Sequence[str]) -> TableDiagnosis:
    from twin.diagnose.tables import diagnose_sweeps
    from twin.rigs import load_rig
    from twin.rigs.beam import is_beam_rig, load_beam_rig
    from twin.rigs.modal import is_modal_rig, load_modal_rig

    if preloads:
        raise InputError("--preload", "", "a table of sweeps is diagnosed without a joint's model", "leave it out")
    if is_modal_rig(rig_name):
        modal = load_modal_rig(rig_name)
        name, channel, source = modal.name, modal.channel, modal.source
    elif is_beam_rig(rig_name):
        name, channel, source = load_beam_rig(rig_name).name, "acc1", ""
    else:
        rig = load_rig(rig_name)
        name, channel, source = rig.name, rig.response_sensors[-1].channel if rig.response_sensors else "acc1", ""
    path = runs[0] if len(runs) == 1 else Path(" ".join(map(str, runs)))
    return diagnose_sweeps(
        _read(runs), path=path, rig_name=name, held_out=_read(held_out), channel=channel, source=source
    )


def _read(paths: Sequence[Path]) -> list[Sweep]:
    """Sweeps of all tables; named after their table where there are several."""
    from twin.identify.modal_table import read_sweeps

    if len(paths) == 1:
        return read_sweeps(paths[0])
    return [replace(sweep, level=f"{path.stem}:{sweep.level}") for path in paths for sweep in read_sweeps(path)]


def _save(result: TableDiagnosis, path: Path) -> None:
    from twin.rigs import save_rig
    from twin.rigs.beam import BeamRig, save_beam_rig
    from twin.rigs.modal import ModalRig, save_modal_rig

    if isinstance(result.model, ModalRig):
        save_modal_rig(result.model, path)
    elif isinstance(result.model, BeamRig):
        save_beam_rig(result.model, path)
    else:
        save_rig(result.model, path)
