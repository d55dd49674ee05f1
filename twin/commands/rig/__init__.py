"""``twin rig``: any rig drawn, its natural frequencies, what of it is implausible; and rigs from matrices."""

from pathlib import Path

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_files
from twin.commands.common.options import FILE, causes_option, json_option, laws_option, overwrite_option
from twin.commands.common.output import print_json, say, tell_assumed, working
from twin.commands.rig.from_matrices import command as import_command

PICTURES = (".png", ".svg", ".pdf", ".jpg")


@click.group("rig")
def command() -> None:
    """Look at a rig before anything is measured with it, or make one from another program's matrices."""


@command.command("show")
@click.argument("rig", metavar="RIG")
@click.option("--preload", metavar="NAME", help="State of the joints; the rig's first if left out.")
@click.option("--save", metavar="FILE.rrd", type=FILE, help="The rig and its modes for rerun.")
@click.option("--picture", metavar="FILE.png", type=FILE, help="The same as a picture.")
@causes_option
@laws_option
@overwrite_option
@json_option
def show(
    rig: str, preload: str | None, save: Path | None, picture: Path | None, overwrite: bool, as_json: bool
) -> None:
    """Assemble RIG, draw it, and tell its natural frequencies and what is implausible of it.

    RIG is a shipped rig's name or a rig file of format 1 or 2.
    """
    from twin.bench import check_effects
    from twin.rigs import known_preload, load_rig
    from twin.rigs.assumed import assumed
    from twin.structure.modelled_rig import modelled_rig
    from twin.structure.plausibility import implausible

    check_writable(save, picture, overwrite=overwrite)
    if picture is not None and picture.suffix.lower() not in PICTURES:
        raise InputError(picture, "", f"{picture.suffix!r} is no picture's suffix", f"one of {', '.join(PICTURES)}")
    loaded = load_rig(rig)
    with working(f"assembling {loaded.name}"):
        modelled = modelled_rig(loaded, preload=known_preload(loaded, preload) if loaded.joints else None)
        check_effects(loaded, source=rig)
        frequencies = modelled.modes.frequency_Hz[:10].tolist()
        warnings = implausible(modelled)
    with whole_files(picture, save) as (drawn, viewed):  # both that were asked for, or neither
        if viewed is not None:
            from twin.views.rerun.rig import save_rig_view

            save_rig_view(modelled, viewed)
        if drawn is not None:
            from twin.views.rig_figure import rig_figure

            rig_figure(modelled).savefig(drawn, format=drawn.suffix.lower().removeprefix("."), dpi=130)
    if as_json:
        print_json({
            "natural_frequencies_Hz": frequencies,
            "rigid_modes": modelled.rigid,
            "parts": [part.name for part in modelled.structure.layout.parts],
            "joints": [joint.name for joint in loaded.joints],
            "laws": {joint.name: joint.law.sentence for joint in loaded.joints if joint.law is not None},
            "reductions": {
                one.part.name: {
                    "degrees_of_freedom": one.reduced.T.shape[0], "reduced_to": one.size,
                    "up_to_Hz": one.part.modes_to_Hz, "frequency_error": one.reduced.error,
                }
                for one in modelled.structure.reductions
            },
            "sensors": [sensor.channel for sensor in loaded.sensor],
            "effects": [effect.cause for effect in loaded.effect],
            "assumed": assumed(loaded),
            "warnings": list(warnings),
        })  # fmt: skip
        return
    say(f"{loaded.name}: {loaded.sentence}")
    for joint in loaded.joints:
        if joint.law is not None:
            say(f"{joint.name}: {joint.law.sentence}")
    for one in modelled.structure.reductions:
        say(f"{one.part.name}: {one.told}")
    tell_assumed(assumed(loaded))
    if loaded.effect:
        named = ", ".join(effect.cause for effect in loaded.effect)
        say(f"effects: {named}; they act on the bench and in predictions, not in these modes")
    if modelled.rigid:
        say(f"{modelled.rigid} rigid motions")
    for number, frequency in enumerate(frequencies, start=1):
        say(f"mode {number}: {frequency:.5g} Hz")
    for warning in warnings:
        say(f"implausible: {warning}")
    for path in (picture, save):
        if path is not None:
            say(f"wrote {path}")


@command.command("export")
@click.argument("rig", metavar="RIG")
@click.option("--mass", metavar="M", type=FILE, required=True, help="Mass: .mtx, .npz or .op4.")
@click.option("--stiffness", metavar="K", type=FILE, required=True, help="Stiffness: .mtx, .npz or .op4.")
@click.option("--nodes", "table", metavar="N.csv", type=FILE, required=True, help="Whose the rows are, and where.")
@click.option("--preload", metavar="NAME", help="State of the joints; the rig's first if left out.")
@causes_option
@overwrite_option
@json_option
def export(
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


command.add_command(import_command)
