"""`twin import`: recordings from anybody's files."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_file
from twin.commands.common.options import FILE, json_option, overwrite_option
from twin.commands.common.output import next_step, print_json, say, working

if TYPE_CHECKING:
    from recordings.run import Run


@click.command(name="import")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=FILE)
@click.option("--out", metavar="RUN", required=True, type=FILE, help="The recording, an .mcap.")
@click.option(
    "--mapping", metavar="MAP.toml", type=FILE,
    help="What the files do not say; if left out, the one beside the first file where there is one.",
)  # fmt: skip
@overwrite_option
@json_option
def command(files: tuple[Path, ...], out: Path, mapping: Path | None, overwrite: bool, as_json: bool) -> None:
    """Make the recording RUN of other programs' files.

    .csv and other text in any dialect, .mat (5 and 7.3), .h5, .wav, .tdms, .parquet, .uff.  Columns, units and sample
    rate are found, and so are the steps of a stepped sine.  What is not known is asked for once: FILE.mapping.toml is
    written beside the first file, with the places to fill in, and read when the command is run again.
    """
    from recordings.convert import write_mcap
    from recordings.importing import Mapping, import_files, mapping_beside, read_mapping

    if out.suffix.lower() != ".mcap":
        raise InputError(out, "", f"{out.suffix!r:.40} is no recording's suffix", "end RUN in .mcap")
    check_writable(out, overwrite=overwrite)
    beside = mapping_beside(files[0])
    chosen = mapping or (beside if beside.is_file() else None)
    known = read_mapping(chosen) if chosen else Mapping()
    with working(f"reading {files[0].name}"):
        imported = import_files(files, known, ask=chosen or beside)
        with whole_file(out) as part:
            write_mcap(imported.run, part)
    told = _told(imported.run)
    if as_json:
        print_json({"run": out, "mapping": chosen, "notes": imported.notes, **told})
    for channel in told["channels"]:
        say(f"{channel['name']}: {channel['quantity']}, {channel['unit']}, {channel['sample_rate_Hz']:g} Hz")
    for sweep in told["sweeps"]:
        first, last = sweep["frequency_Hz"]
        say(f"sweep {sweep['name']}: {sweep['steps']} steps" + (f", {first:.5g} to {last:.5g} Hz" if last else ""))
    for note in imported.notes:
        say(f"note: {note}")
    say(f"{out}: written")
    next_step(f"twin check {out}")


def _told(run: Run) -> dict[str, Any]:
    """Channels and sweeps, for people and programs."""
    from recordings.sweeps import sweeps

    return {
        "channels": [
            {
                "name": name, "quantity": run.channels[name].quantity, "unit": run.channels[name].unit,
                "device": device.device, "sample_rate_Hz": device.sample_rate_Hz, "samples": len(device),
            }
            for device in run.devices.values()
            for name in device.values
        ],
        "sweeps": [
            {
                "name": sweep.name, "steps": len(sweep.stretches),
                "frequency_Hz": [each.step.frequency_Hz for each in (sweep.stretches[0], sweep.stretches[-1])],
            }
            for sweep in sweeps(run)
        ],
    }  # fmt: skip
