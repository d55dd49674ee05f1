"""`twin replay`: a recorded run behind the same instruments."""

from pathlib import Path

import click

from recordings.errors import InputError
from twin.commands.common.options import FILE, json_option
from twin.commands.common.output import say
from twin.commands.common.serving import Serving, address_options, serve_source


@click.command()
@click.argument("run", type=FILE)
@click.option("--meter", metavar="auto|PATH|HOST:PORT", help="A slow SCPI meter of what the run has as indicators.")
@address_options
@json_option
def command(run: Path, meter: str | None, serving: Serving, as_json: bool) -> None:
    """Serve the samples of a recorded RUN, until SIGINT or SIGTERM; the stream ends where the recording ends.

    Over serial and TCP they are the same bit for bit; a CAN node rounds them to 16 bits of its channel's range, which
    changes nothing of what a CAN node has recorded.  Samples that the recording lost are lost again.
    """
    from drivers.virtual import RecordedMeter, RecordedSource
    from recordings import read_run

    if run.suffix.lower() == ".csv":
        raise InputError(run, "", "is a table, which has no samples to serve", "give the recording (.mcap)")
    recorded = read_run(run)
    for device, slip in RecordedSource(recorded).slips.items():
        line = f"{run}: {device} has a clock of its own, {slip:+.1f} samples off at the end; the replay has one clock"
        say(f"warning: {line}")
    slow = RecordedMeter(recorded) if meter is not None else None
    serve_source(lambda: RecordedSource(recorded), serving, origin="replayed", as_json=as_json, meter=meter, slow=slow)
