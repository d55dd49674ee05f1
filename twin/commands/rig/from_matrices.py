"""``twin rig import``: a commented rig file of format 2 from another program's matrices."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.errors import InputError
from twin.commands.common.options import FILE, FiniteRange, json_option, overwrite_option
from twin.commands.common.output import print_json, say, working

if TYPE_CHECKING:
    from twin.rigs.imported import Imported, PartFiles

UNIT_NAMES = ("m-kg-s", "mm-t-s", "mm-kg-ms", "in-lbf-s")


@click.command("import")
@click.option("--mass", metavar="M", type=FILE, multiple=True, required=True, help="Mass; once for each part.")
@click.option(
    "--stiffness", metavar="K", type=FILE, multiple=True, required=True, help="Stiffness; once for each part."
)
@click.option("--nodes", metavar="N", type=FILE, multiple=True, help="Where the nodes are; once for each part.")
@click.option("--part", metavar="NAME", multiple=True, help="Name; once for each part.")
@click.option("--out", metavar="RIG.toml", type=FILE, required=True, help="The rig file; its matrices come beside it.")
@click.option("--units", type=click.Choice(UNIT_NAMES), help="Of the model; guessed and told if left out.")
@click.option("--support", metavar="PLACE[:x,y,...]", multiple=True, help="A node that is held, as often as needed.")
@click.option("--drive", metavar="PLACE:+y", help="Where the shaker drives; a soft place if left out.")
@click.option("--sensor", metavar="[NAME=]PLACE:+y", multiple=True, help="An accelerometer; at the drive if left out.")
@click.option(
    "--modes-to", metavar="HZ", type=FiniteRange(1e-3, 1e6), default=2000.0, show_default=True,
    help="What the reduction must keep.",
)  # fmt: skip
@overwrite_option
@json_option
def command(
    mass: tuple[Path, ...], stiffness: tuple[Path, ...], nodes: tuple[Path, ...], part: tuple[str, ...], out: Path,
    units: str | None, support: tuple[str, ...], drive: str | None, sensor: tuple[str, ...], modes_to: float,
    overwrite: bool, as_json: bool,
) -> None:  # fmt: skip
    """Write RIG.toml from the matrices of a finite-element program, and beside it what it needs, in SI units.

    Matrices: Nastran .op4 and .pch (DMIG), Abaqus .mtx (assembled or of a substructure), CalculiX .sti and .mas with
    .dof, Matrix Market .mtx, scipy's .npz.  Nodes: CSV (node, dof, row, x_m, y_m, z_m, or node, x, y, z), universal
    files, an Abaqus or CalculiX .inp, Nastran's GRID entries.

    A PLACE is x,y,z in metres, for which the nearest node is taken, or a node's number, or PART/NODE.
    """
    from twin.rigs.imported import ImportRequest, imported_rig

    with working(f"importing {len(mass)} part{'s' if len(mass) > 1 else ''}"):
        parts = _parts(mass, stiffness, nodes, part)
        request = ImportRequest(parts, out, units, drive, sensor, support, modes_to)
        imported = imported_rig(request, overwrite=overwrite)
    if as_json:
        print_json(_table(imported))
        return
    for each in imported.contents.parts:
        size = " x ".join(f"{1e3 * side:.4g}" for side in each.size_m)
        say(
            f"{each.name}: {each.matrices.M.shape[0]} rows, {each.mass_kg:.4g} kg, {size} mm, read in {each.units.name}"
        )
        for note in each.notes:
            say(f"note: {note}")
    for joint in imported.contents.joints:
        say(f"joint {joint.name}: {len(joint.pairs.a)} pairs of nodes, {1e6 * joint.pairs.area_m2.sum():.4g} mm2")
    place, direction = imported.contents.drive
    say(f"drive along {direction}: {place.told}")
    for warning in imported.warnings:
        say(f"warning: {warning}")
    say(f"{out}: written; check what its comments ask for, then: twin rig show {out}")


def _parts(
    mass: tuple[Path, ...], stiffness: tuple[Path, ...], nodes: tuple[Path, ...], names: tuple[str, ...]
) -> tuple[PartFiles, ...]:
    from twin.rigs.imported import PartFiles

    count = len(mass)
    for option, given, least in (("--stiffness", stiffness, count), ("--nodes", nodes, 0), ("--part", names, 0)):
        if len(given) not in (least, count):
            raise InputError(
                option, "", f"{len(given)} for {count} masses", "give it once for each part, in their order"
            )
    usual = ["part"] if count == 1 else [f"part{number}" for number in range(1, count + 1)]
    tables = nodes or (None,) * count
    for name in names:
        if not name.replace("-", "").replace("_", "").isalnum():
            raise InputError("--part", "", f"{name[:40]!r} is part of file names", "use letters, digits, - and _")
    return tuple(map(PartFiles, names or usual, mass, stiffness, tables))


def _table(imported: Imported) -> dict[str, Any]:
    contents = imported.contents
    place, direction = contents.drive
    return {
        "rig": imported.files[0],
        "parts": [
            {
                "name": part.name, "rows": part.matrices.M.shape[0], "nodes": len(part.matrices.nodes),
                "mass_kg": part.mass_kg, "size_m": list(part.size_m), "units": part.units.name,
                "notes": list(part.notes),
            }
            for part in contents.parts
        ],
        "joints": [{"name": joint.name, "pairs": len(joint.pairs.a)} for joint in contents.joints],
        "drive": {"part": place.part.name, "node": place.node, "direction": direction},
        "sensors": [
            {"channel": name, "part": place.part.name, "node": place.node, "direction": direction}
            for name, place, direction in contents.sensors
        ],
        "supports": [
            {"part": place.part.name, "node": place.node, "fix": list(dofs)} for place, dofs in contents.supports
        ],
        "files": list(imported.files),
        "warnings": list(imported.warnings),
    }  # fmt: skip
