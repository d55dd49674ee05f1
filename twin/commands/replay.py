"""`twin replay`: a recorded run behind the same instruments."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from twin.commands.output import json_option
from twin.commands.serving import address_options, serve_source

__all__ = ["command"]


@click.command()
@click.argument("run", type=click.Path(path_type=Path))
@address_options
@json_option
def command(run: Path, **options: Any) -> None:
    """Serve the samples of a recorded RUN, until SIGINT or SIGTERM; the stream ends where the recording ends.

    Over serial and TCP they are the same bit for bit; a CAN node rounds them to 16 bits of its channel's range.
    """
    from drivers.virtual import RecordedSource
    from recordings import read_run

    serve_source(lambda: RecordedSource(read_run(run)), origin="replayed", **options)
