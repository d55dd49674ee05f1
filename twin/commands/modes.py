"""``twin modes``: natural frequencies, damping and shapes from hits or from noise, without a model or beside one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_files
from twin.commands.common.options import FILE, FiniteRange, json_option, overwrite_option
from twin.commands.common.output import print_json, print_tables, say, typed, working

if TYPE_CHECKING:
    from twin.identify.modes.measured_modes import MeasuredModes


@click.command()
@click.argument("run", metavar="RUN.mcap", type=FILE)
@click.option("--rig", "rig_name", metavar="RIG", help="Whose modes they are compared with: pairs, MAC, nodes.")
@click.option("--force", metavar="CHANNEL", help="The force; the only force channel if left out.")
@click.option("--band", nargs=2, type=float, metavar="LOW HIGH", help="Hz; what the force excites if left out.")
@click.option(
    "--estimator", type=click.Choice(["H1", "H2", "Hv"]), help="Of an impact test's responses; H1 if left out."
)  # fmt: skip
@click.option(
    "--force-window", type=FiniteRange(min=0, min_open=True), metavar="S",
    help="Of an impact test: kept of the force to either side of its peak; the pulse if left out.",
)  # fmt: skip
@click.option(
    "--exponential", type=FiniteRange(0, 1, min_open=True), metavar="SHARE",
    help="Of an impact test: what the window leaves at a record's end, 1 for none; what the decay needs if left out.",
)  # fmt: skip
@click.option(
    "--out", metavar="MODES.csv", type=FILE,
    help="Table of frequencies, which 'twin identify' and 'twin diagnose' take; with a rig by its modes' numbers.",
)  # fmt: skip
@click.option("--picture", metavar="FILE.png", type=FILE, help="The stabilisation chart.")
@click.option("--report", metavar="FILE.html", type=FILE, help="Tables and all pictures.")
@click.option("--save", metavar="FILE.rrd", type=FILE, help="Charts, and with a rig the shapes moving, for rerun.")
@overwrite_option
@json_option
def command(
    run: Path, rig_name: str | None, force: str | None, band: tuple[float, float] | None, estimator: str | None,
    force_window: float | None, exponential: float | None, out: Path | None, picture: Path | None,
    report: Path | None, save: Path | None, overwrite: bool, as_json: bool,
) -> None:  # fmt: skip
    """Fit rational functions of rising order to the responses of RUN: an impact test, or its first broadband stretch.

    Poles that stay where they are as the order grows are modes; maximum likelihood then gives their frequencies,
    damping ratios and standard deviations.  Of an impact test double hits and overloads are set aside, and what is
    wrong with windows and places is told.
    """
    check_writable(out, picture, report, save, overwrite=overwrite)
    if band is not None and not 0 < band[0] < band[1]:
        raise InputError("--band", "", f"{band[0]:g} to {band[1]:g} Hz is no band")
    from recordings import read_run
    from twin.identify.impacts import Reduction
    from twin.lab.modal_test import modal_test
    from twin.rigs import load_rig

    rig = None if rig_name is None else load_rig(rig_name)
    how = None
    if (estimator, force_window, exponential) != (None, None, None):
        how = Reduction(estimator=estimator or "H1", force_window_s=force_window, left=exponential)  # type: ignore[arg-type]
    recorded = read_run(run)
    with working("fitting modes"):
        test = modal_test(recorded, force=force, band_Hz=band, rig=rig, reduction=how)
    with whole_files(out, picture, report, save) as (table, drawn, page, view):
        if table is not None:
            _write_table(test.found, table)
        if drawn is not None:
            from twin.views.modal_figures import stabilisation_figure

            stabilisation_figure(test.found).savefig(drawn, format="png", dpi=150)
        if page is not None:
            test.report(page, commands=[typed()])
        if view is not None:
            from twin.views.rerun.modes import save_modes_view

            save_modes_view(test.found, view)
    if as_json:
        print_json(test.to_dict())
    else:
        print_tables(*test.tables())
    for note in test.found.notes:
        say(("note", "yellow"), f": {note}")
    say(test.sentence)


def _write_table(found: MeasuredModes, out: Path) -> None:
    """Modes by the model's numbers where there is one, whose modes may not all have been found."""
    modes = found.fit.modes
    numbers = {r: r + 1 for r in range(len(modes))} if found.beside is None else found.beside.numbers
    rows = [f"{n},{modes[r].frequency_Hz:.8g},{modes[r].frequency_std_Hz:.3g}" for r, n in numbers.items()]
    if len(rows) < len(modes):
        left = len(modes) - len(rows)
        say(("note", "yellow"), f": {left} mode(s) left out of the table: none of the model's that it counts")
    out.write_text("\n".join(["mode,frequency_Hz,std_Hz", *rows]) + "\n", encoding="utf-8")
