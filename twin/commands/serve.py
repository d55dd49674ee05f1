"""`twin serve`: the virtual instruments of a rig."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from twin.commands.output import json_option
from twin.commands.serving import address_options, serve_source

if TYPE_CHECKING:
    from recordings.streams import SampleSource

__all__ = ["command"]


@click.command()
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option(
    "--commands",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=lambda context, _, wanted: _print_commands(context) if wanted else None,
    help="Print the instrument's SCPI commands, and leave.",
)
@click.option("--preload", metavar="NAME", help="State of the joint; the rig's first if left out.")
@address_options
@json_option
def command(rig_name: str, preload: str | None, seed: int, **options: Any) -> None:
    """Serve the virtual instruments of a rig over serial, TCP and CAN, until SIGINT or SIGTERM.

    Their addresses are printed as JSON lines when they are ready.
    """
    from recordings.streams import Excitation
    from twin.bench import open_bench
    from twin.rigs import load_rig

    rig = load_rig(rig_name)
    try:
        name = rig.preload_name(preload)
    except KeyError as error:
        raise InputError("--preload", "", str(error.args[0])) from error

    def open_source() -> SampleSource:
        try:
            # The first samples of a fresh installation compile the kernels, longer than any client waits: do it now.
            rehearsed = open_bench(rig, preload=name, seed=seed)
            rehearsed.set_output(Excitation(kind="sine", amplitude_V=0.1, frequency_Hz=20.0))
            rehearsed.read(64)
            return open_bench(rig, preload=name, seed=seed)
        except ValueError as error:
            raise InputError(rig_name, "", str(error)) from error

    serve_source(open_source, origin="simulated", seed=seed, **options)


def _print_commands(context: click.Context) -> None:
    from drivers.virtual import AcquisitionInstrument

    click.echo(AcquisitionInstrument.table().describe())
    context.exit()
