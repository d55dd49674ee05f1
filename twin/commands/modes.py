"""``twin modes``: natural frequencies and damping from broadband recordings alone, without a model."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError
from recordings.whole import check_writable, whole_files
from twin.commands.common.options import FILE, json_option, overwrite_option
from twin.commands.common.output import print_json, print_tables, working

if TYPE_CHECKING:
    from twin.identify.modes.from_record import RecordedModes


@click.command()
@click.argument("run", metavar="RUN.mcap", type=FILE)
@click.option("--force", metavar="CHANNEL", help="The force; the only force channel if left out.")
@click.option("--band", nargs=2, type=float, metavar="LOW HIGH", help="Hz; what the force excites if left out.")
@click.option(
    "--out", metavar="MODES.csv", type=FILE,
    help="Table of frequencies, which 'twin identify' and 'twin diagnose' take.",
)  # fmt: skip
@click.option("--picture", metavar="FILE.png", type=FILE, help="The stabilisation chart.")
@overwrite_option
@json_option
def command(
    run: Path, force: str | None, band: tuple[float, float] | None, out: Path | None, picture: Path | None,
    overwrite: bool, as_json: bool,
) -> None:  # fmt: skip
    """Fit rational functions of rising order to the responses of RUN's first broadband stretch.

    Poles that stay where they are as the order grows are modes; maximum likelihood then gives their frequencies,
    damping ratios and standard deviations.
    """
    check_writable(out, picture, overwrite=overwrite)
    if band is not None and not 0 < band[0] < band[1]:
        raise InputError("--band", "", f"{band[0]:g} to {band[1]:g} Hz is no band")
    force, channels, found = _found(run, force, band)
    modes = [
        {
            "frequency_Hz": {"value": mode.frequency_Hz, "std": mode.frequency_std_Hz},
            "damping_ratio": {"value": mode.damping_ratio, "std": mode.damping_std},
            "residues": {c: [r.real, r.imag] for c, r in zip(channels, mode.residues.tolist(), strict=True)},
            "share_of_orders": mode.share,
        }
        for mode in found.fit.modes
    ]
    with whole_files(out, picture) as (table, drawn):
        if table is not None:
            _write_table(found, table)
        if drawn is not None:
            from twin.views.stabilisation import stabilisation_figure

            stabilisation_figure(found.fit, found.response).savefig(drawn, format="png", dpi=150)
    if as_json:
        print_json({
            "run": str(run), "force": force, "channels": list(channels), "modes": modes,
            "chi2_per_dof": found.fit.chi2_per_dof, "lines": len(found.response.frequency_Hz),
        })  # fmt: skip
    else:
        _tell(found)


def _found(
    run: Path, force: str | None, band: tuple[float, float] | None
) -> tuple[str, tuple[str, ...], RecordedModes]:
    from recordings import read_run
    from twin.identify.modes.from_record import modes_of_record
    from twin.identify.spectrum import broadband_records

    recorded = read_run(run)
    forces = [name for name, channel in recorded.channels.items() if channel.quantity == "force"]
    if force is None and len(forces) != 1:
        raise InputError(run, "channels", f"holds {len(forces)} force channels", "name one with --force")
    force = force or forces[0]
    if force not in recorded.channels:
        raise InputError(run, f"channel {force}", "not recorded", f"it has {', '.join(recorded.channels)}")
    kinds = ("acceleration", "velocity", "displacement")
    channels = tuple(n for n, c in recorded.channels.items() if c.quantity in kinds and n != force)
    if not channels:
        raise InputError(run, "channels", "holds no acceleration, velocity or displacement")
    records = broadband_records(recorded, channels=[force, *channels])
    if not records:
        raise InputError(run, "/procedure", "holds no broadband stretch", "run a procedure of kind random")
    with working("fitting modes"):
        try:
            return force, channels, modes_of_record(records[0], force=force, channels=channels, band_Hz=band)
        except ValueError as error:
            raise InputError(run, "", str(error)) from error


def _write_table(found: RecordedModes, out: Path) -> None:
    rows = [
        f"{number},{mode.frequency_Hz:.8g},{mode.frequency_std_Hz:.3g}"
        for number, mode in enumerate(found.fit.modes, 1)
    ]
    out.write_text("\n".join(["mode,frequency_Hz,std_Hz", *rows]) + "\n", encoding="utf-8")


def _tell(found: RecordedModes) -> None:
    from twin.views.table import Table

    rows = [
        (
            str(number), f"{mode.frequency_Hz:.4f}", f"{mode.frequency_std_Hz:.2g}", f"{100 * mode.damping_ratio:.4f}",
            f"{100 * mode.damping_std:.2g}", f"{mode.share:.0%}",
        )
        for number, mode in enumerate(found.fit.modes, 1)
    ]  # fmt: skip
    head = ("mode", "frequency (Hz)", "std", "damping ratio (%)", "std", "in share of orders")
    print_tables(Table(caption="Modes", head=head, rows=rows, numbers=range(6)))
