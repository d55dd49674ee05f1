"""``twin couple``: a part known by its responses coupled to models of the others; their joints identified."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.staging import staged_folder
from twin.commands.common.options import FILE, json_option, overwrite_option
from twin.commands.common.output import print_json, print_tables, say, working, write_json

if TYPE_CHECKING:
    from twin.lab.coupled import CoupledResponses

RESULTS = ("coupled.uff", "coupled.npz", "coupled.png", "result.json")


@click.command()
@click.argument("rig", metavar="RIG")
@click.option("--measured", metavar="COUPLED", type=FILE, help="Responses of the whole: its joints are identified.")
@click.option("--preload", metavar="NAME", help="State of the modelled parts' own joints; the first if left out.")
@click.option("--out", metavar="DIR", type=FILE, required=True, help="Folder of the results.")
@overwrite_option
@json_option
def command(rig: str, measured: Path | None, preload: str | None, out: Path, overwrite: bool, as_json: bool) -> None:
    """Couple the parts of RIG, a rig file of kind "substructures", of which some are known by their responses only.

    Writes the responses of the rig's sensors over the forces of its drives (coupled.uff, and with their standard
    deviations coupled.npz), a picture and result.json.  With --measured the stiffness and the loss factor of every
    connection are identified first.
    """
    from twin.lab.coupled import couple

    with staged_folder(out, results=RESULTS, overwrite=overwrite) as folder, working("coupling"):
        found = couple(rig, measured=measured, preload=preload)
        _write(found, folder)
        result = found.to_dict()
        write_json(result, folder / "result.json")
    if as_json:
        print_json(result)
    else:
        print_tables(*found.tables())
    for note in found.notes:
        say(("note", "yellow"), f": {note}")
    say(f"{found.sentence}  Results in {out}")


def _write(found: CoupledResponses, folder: Path) -> None:
    """Responses as a universal file and as an archive, and the picture."""
    import numpy as np

    from recordings.directions import direction_name
    from recordings.quantities import quantity
    from recordings.run import Channel, Run
    from twin.exchange import FrequencyResponses, write_universal

    rig, predicted = found.parts.rig, found.predicted
    channels = {
        one.channel: Channel(
            name=one.channel, quantity=one.quantity, unit=quantity(one.quantity).unit,
            direction=direction_name(rig.place_of(one.channel).direction),
        )
        for one in rig.sensor
    }  # fmt: skip
    forces = [rig.force_cells[drive] for drive in rig.drives]
    sensors = [sensor.channel for sensor in rig.response_sensors]
    columns = [
        FrequencyResponses(
            sweep="coupled", frequency_Hz=predicted.frequency_Hz, frf=predicted.H[:, :, number].T, coherence=None,
            responses=tuple(channels[name] for name in sensors), force=channels[force], frf_form="",
        )
        for number, force in enumerate(forces)
    ]  # fmt: skip
    run = Run(path=rig.name, info={"rig": rig.name}, channels=channels, devices={}, steps=(), events=())
    write_universal(columns, folder / "coupled.uff", run=run)
    forms = {quantity(sensor.quantity).per_force for sensor in rig.response_sensors}
    with (folder / "coupled.npz").open("wb") as stream:
        np.savez(
            stream, frequency_Hz=predicted.frequency_Hz, frf=np.moveaxis(predicted.H, 0, 2), channels=sensors,
            std=np.moveaxis(predicted.std, 0, 2), references=forces, frf_form=forms.pop() if len(forms) == 1 else "",
        )  # fmt: skip
    found.plot().savefig(folder / "coupled.png", format="png", dpi=150)
