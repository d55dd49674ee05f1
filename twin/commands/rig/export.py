"""``twin rig export``: a rig's matrices for another program."""

from pathlib import Path

import click

from twin.commands.common.options import FILE, causes_option, json_option, overwrite_option
from twin.commands.common.output import print_json, say, working


@click.command("export")
@click.argument("rig", metavar="RIG")
@click.option("--mass", metavar="M", type=FILE, required=True, help="Mass: .mtx, .npz or .op4.")
@click.option("--stiffness", metavar="K", type=FILE, required=True, help="Stiffness: .mtx, .npz or .op4.")
@click.option("--nodes", "table", metavar="N.csv", type=FILE, required=True, help="Whose the rows are, and where.")
@click.option("--preload", metavar="NAME", help="State of the joints; the rig's first if left out.")
@causes_option
@overwrite_option
@json_option
def command(
    rig: str, mass: Path, stiffness: Path, table: Path, preload: str | None, overwrite: bool, as_json: bool
) -> None:
    """Write the matrices of RIG, as assembled from its beams, masses, springs and joints, in SI units.

    An identified model is written as any other rig: so its updated numbers reach another program.  Matrix Market
    (.mtx), scipy's .npz or Nastran's OUTPUT4 as text (.op4), by suffix.
    """
    from twin.exchange.matrices import write_matrices
    from twin.rigs import known_preload, load_rig

    loaded = load_rig(rig)
    with working(f"assembling {loaded.name}"):
        state = known_preload(loaded, preload) if loaded.joints else None
        rows = write_matrices(loaded, mass, stiffness, table, preload=state, overwrite=overwrite)
    if as_json:
        print_json({"mass": str(mass), "stiffness": str(stiffness), "nodes": str(table), "rows": rows})
    else:
        say(f"{mass}, {stiffness}, {table}: written, {rows} rows")
