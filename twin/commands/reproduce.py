"""``twin reproduce``: the papers' tables side by side with this project's."""

from dataclasses import asdict

import click

from twin.commands.common.options import json_option
from twin.commands.common.output import print_json, print_tables, working

STUDIES = ("steel-lap-joint", "composite-beam", "hybrid-joint")


@click.command()
@click.argument("names", metavar="[" + "|".join(STUDIES) + "]...", nargs=-1, type=click.Choice(STUDIES))
@click.option("--frequencies-only", is_flag=True, help="Leave out the nonlinear sweeps, which take a minute or two.")
@json_option
def command(names: tuple[str, ...], frequencies_only: bool, as_json: bool) -> None:
    """Recompute the papers' tables from their measured frequencies; all three studies unless some are named.

    The nonlinear sweeps are recorded on the bench with laws of the papers' form, and identified from the recordings.
    """
    from studies.by_name import reproduce
    from studies.printed import tables

    chosen = list(dict.fromkeys(names)) or list(STUDIES)
    results = {}
    for name in chosen:
        with working(f"{name}: fitting the measured frequencies"):
            results[name] = reproduce(name, sweeps=not frequencies_only)
    if as_json:
        print_json({name: asdict(result) for name, result in results.items()})
        return
    for name, result in results.items():
        click.echo(f"{name}: {result.source}\n")
        print_tables(*tables(result))
        for note in result.notes:
            click.echo(f"- {note}")
