"""The option that says how natural frequencies scatter from one assembly to the next."""

import click

scatter_option = click.option(
    "--frequency-scatter", metavar="SHARE", type=click.FloatRange(min=0, max=0.1, max_open=True),
    help="Of frequency responses: how natural frequencies scatter from one assembly to the next, as 0.003; by default "
    "what several cases of one state show, or the rig file says.",
)  # fmt: skip
