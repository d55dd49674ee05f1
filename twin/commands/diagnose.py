"""``twin diagnose``: what the model gets wrong, the cause, the extended model, the gain."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Any

import click

from recordings.errors import InputError
from twin.commands.output import console, json_option, print_json, write_json

__all__ = ["command"]

REPORT, VIEW = "report.html", "view.rrd"


@click.command(name="diagnose", short_help="Show what the model gets wrong and name the cause.")
@click.argument("runs", nargs=-1, required=True, type=click.Path(path_type=Path))
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option("--preload", default=None, help="Name of the rig's preload; from the recording by default.")
@click.option("--held-out", multiple=True, type=click.Path(path_type=Path), help="A run kept for the gain; repeatable.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder for result, report and pictures.")
@json_option
def command(
    runs: tuple[Path, ...],
    rig_name: str,
    preload: str | None,
    held_out: tuple[Path, ...],
    out: Path,
    as_json: bool,
) -> None:
    r"""Say what the model of RIG gets wrong about the recorded RUNs.

    \b
    Example:
      twin diagnose random.mcap sweeps.mcap --held-out heldout.mcap --rig steel-lap-joint --out diagnosis
    """
    from recordings import read_run
    from twin.diagnose import diagnose
    from twin.rigs import load_rig
    from twin.views import save_diagnosis, write_report

    rig = load_rig(rig_name)
    if preload is not None and preload not in rig.joint.preload:
        raise InputError(rig_name, f"preload {preload}", "no such preload", f"it has {', '.join(rig.joint.preload)}")
    if out.exists() and not out.is_dir():
        raise InputError(out, "", "not a folder")
    recorded, kept = [read_run(path) for path in runs], [read_run(path) for path in held_out]
    with console.status("starting") as status:
        result = diagnose(recorded, rig, preload=preload, held_out=kept, out=out, report=lambda t: status.update(t))
        status.update("writing the report and the pictures")
        write_report(result, out / REPORT, commands=[_again(runs, held_out, rig_name, out)])
        save_diagnosis(result, out / VIEW)
    data = result.to_dict()
    write_json(data, out / "result.json")
    if as_json:
        print_json(data)
    else:
        _tell(data, out)


def _again(runs: tuple[Path, ...], held_out: tuple[Path, ...], rig_name: str, out: Path) -> str:
    """The command that makes the same report."""
    words = ["twin", "diagnose", *map(str, runs)]
    for path in held_out:
        words += ["--held-out", str(path)]
    return shlex.join([*words, "--rig", rig_name, "--out", str(out)])


def _tell(data: dict[str, Any], out: Path) -> None:
    """The answer for a person."""
    from rich.table import Table

    console.print(f"[bold]{data['answer']}[/bold]")
    misfit = data["misfit"]
    console.print(
        f"misfit: chi2 per degree of freedom {misfit['chi2_per_dof']:.3g} before, {misfit['after']:.3g} after "
        f"(agreement up to {misfit['threshold']:g})"
    )
    if data["causes"]:
        table = Table("cause", "probability", "in the model", "parameters", "confused with")
        for cause in data["causes"]:
            values = ", ".join(
                f"{name} = {value}" if isinstance(value, str) else f"{name} = {value['value']:.4g} ± {value['std']:.1g}"
                for name, value in cause["parameters"].items()
            )
            rivals = ", ".join(cause["confused_with"]) or "-"
            chosen = "yes" if cause["in_model"] else "no"
            table.add_row(cause["cause"], f"{cause['probability']:.2f}", chosen, values, rivals)
        console.print(table)
    if data["gain"]:
        held = data["gain"]["held_out"]
        console.print(
            f"held out ({', '.join(data['gain']['sweeps'])}): relative error {held['before']:.3g} before, "
            f"{held['after']:.3g} after, noise floor {held['noise_floor']:.2g}"
        )
    for note in data["notes"]:
        console.print(f"note: {note}")
    written = ", ".join(str(out / name) for name in ("result.json", data["extended_model"], REPORT, VIEW))
    console.print(f"written: {written}; {data['seconds']:.0f} s")
