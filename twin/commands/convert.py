"""`twin convert`: recordings from and to the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from twin.commands.output import console, json_option, print_json

if TYPE_CHECKING:
    from recordings.convert import Format

__all__ = ["command"]


@click.command(name="convert")
@click.argument("source", metavar="IN", type=click.Path(path_type=Path))
@click.argument("target", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--overwrite", is_flag=True, help="Replace OUT if it exists.")
@json_option
def command(source: Path, target: Path, overwrite: bool, as_json: bool) -> None:
    """Convert the recording IN to OUT; both formats are chosen by suffix.

    .mcap, .uff or .unv (data set 58), .csv (samples with a head of metadata), .mat (MATLAB 5), .blf (the frames of
    CAN FD nodes, as in the shipped database).  Samples keep their float32 values and SI units, but for .blf, which
    has 16 bits; what a format has no place for is told.
    """
    from recordings.convert import convert

    notes = convert(source, target, formats=formats(), overwrite=overwrite)
    if as_json:
        print_json({"source": source, "target": target, "notes": notes})
        return
    for note in notes:
        console.print(f"note: {note}", markup=False, soft_wrap=True)
    console.print(f"{target}: written", markup=False, soft_wrap=True)


def formats() -> tuple[Format, ...]:
    """All formats; those that need hardware knowledge are added here, not in `recordings`."""
    from drivers.blf import read_blf, write_blf
    from recordings.convert import FORMATS, Format

    return (*FORMATS, Format(suffix=".blf", name="BLF", read=read_blf, write=write_blf))
