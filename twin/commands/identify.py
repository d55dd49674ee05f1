"""``twin identify``: a model file and its report from recordings, or from a table."""

import shlex
from pathlib import Path

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_files
from twin.commands.common.options import FILE, causes_option, json_option, laws_option, overwrite_option, scatter_option
from twin.commands.common.output import next_step, print_json, print_tables, say, tell_assumed, typed, working


@click.command()
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=FILE)
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option("--preload", metavar="NAME", help="State of the joint; what the recordings name if left out.")
@click.option("--out", required=True, metavar="MODEL", type=FILE, help="The model, TOML.")
@click.option(
    "--report", metavar="FILE", type=FILE,
    help="The report, HTML; beside the model and named like it if left out.",
)  # fmt: skip
@scatter_option
@click.option("--no-report", is_flag=True, help="Write the model alone.")
@overwrite_option
@causes_option
@laws_option
@json_option
def command(
    runs: tuple[Path, ...],
    rig_name: str,
    preload: str | None,
    out: Path,
    report: Path | None,
    frequency_scatter: float | None,
    no_report: bool,
    overwrite: bool,
    as_json: bool,
) -> None:
    """Identify the model of a rig from RUNs.

    Recordings (.mcap): broadband runs and stepped sines together give the layer's moduli, the modal damping and the
    joint's law.  A table of natural frequencies (.csv) gives the joints' moduli, of a rig without joints its
    beams'; a table of sweeps gives the law of a rig of kind modal, such as brake-reuss.  Frequency responses (.uff,
    .npz, .csv) of one state update moduli, densities, springs and clamps, and give damping and what the model keeps
    wrong in each mode.

    The report says how well each value is known, what is left of every sweep, and how the law's regularisation was
    chosen.
    """
    page = None if no_report else report or out.with_suffix(".html")
    check_writable(out, page, overwrite=overwrite)
    if page == out:
        raise InputError(out, "", "is the report's name too", "name the model .toml, or give another --report")
    from studies.force_levels import with_polynomials
    from twin.lab import load_rig
    from twin.rigs.beam import BeamRig

    rig = load_rig(rig_name)
    with working("reading") as begin:
        model = rig.identify(
            runs, preload=preload, frequency_scatter=frequency_scatter, beside=with_polynomials, report=begin
        )  # fmt: skip
        begin("writing the model" + (" and the report" if page else ""))
        with whole_files(out, page) as (part, page_part):
            assert part is not None
            model.save(part)
            if page_part is not None:
                model.report(page_part, commands=[typed()], files=(rig_name, *map(str, runs)))
    tell_assumed(model.assumed)
    for warning in model.warnings:
        say(f"warning: {warning}")
    files = {"model": str(out), "report": None if page is None else str(page)}
    if as_json:
        print_json({**model.to_dict(), **files})
    else:
        print_tables(*model.tables())
    say(f"model in {out}" + (f", report in {page}" if page else ""))
    if not isinstance(model.file, BeamRig):
        next_step(f"twin predict {shlex.quote(str(out))} --drive DRIVE.csv --out RESPONSE.csv")
