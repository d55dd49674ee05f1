"""`twin convert`: recordings from and to the formats of other programs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError
from recordings.whole import refuse_existing
from twin.commands.common.options import FILE, FiniteRange, json_option, overwrite_option
from twin.commands.common.output import print_json, say, working

if TYPE_CHECKING:
    from recordings.convert import Format


@click.command(name="convert")
@click.argument("source", metavar="IN", type=FILE)
@click.argument("target", metavar="OUT", type=FILE)
@overwrite_option
@click.option("--frf", is_flag=True, help="Write frequency responses instead of samples; OUT is .uff or .unv.")
@click.option("--sweep", metavar="NAME", help="With --frf: of this sweep only.  All if left out.")
@click.option(
    "--resolution", type=FiniteRange(1e-4, 1e3), default=0.1, show_default=True, metavar="HZ",
    help="With --frf: of broadband stretches.",
)  # fmt: skip
@json_option
def command(
    source: Path, target: Path, overwrite: bool, frf: bool, sweep: str | None, resolution: float, as_json: bool
) -> None:
    """Convert the recording IN to OUT; both formats are chosen by suffix.

    .mcap, .uff or .unv (data set 58), .csv (samples with a head of metadata), .mat (MATLAB 5), .blf (the frames of
    CAN FD nodes, as in the shipped database).  Samples keep their float32 values and SI units, but for .blf, which
    has 16 bits; what a format has no place for is told.

    With --frf, OUT is a universal file of frequency responses per force (function type 4): H1 of broadband stretches
    with its coherence, the ratio of the fundamentals at every step of a stepped sine.  Some programs, sdypy-EMA among
    them, take one sweep a file only.
    """
    from recordings.convert import convert

    notes: list[str] = []
    with working(f"converting {source.name}"):
        if frf:
            notes = _write_responses(source, target, sweep, resolution, overwrite)
        elif sweep is not None:
            raise InputError("--sweep", "", "chooses among frequency responses", "add --frf")
        else:
            notes = convert(source, target, formats=formats(), overwrite=overwrite)
    if as_json:
        print_json({"source": source, "target": target, "notes": notes})
    for note in notes:
        say(f"note: {note}")
    say(f"{target}: written")


def formats() -> tuple[Format, ...]:
    """All formats; those that need hardware knowledge are added here, not in `recordings`."""
    from drivers.blf import read_blf, write_blf
    from recordings.convert import FORMATS, Format

    return (*FORMATS, Format(suffix=".blf", name="BLF", read=read_blf, write=write_blf))


def _write_responses(source: Path, target: Path, sweep: str | None, resolution_Hz: float, overwrite: bool) -> list[str]:
    """The frequency responses of a recording as a universal file; what was found."""
    from recordings.convert import read_as
    from twin.exchange import frequency_responses, write_universal

    if target.suffix.lower() not in (".uff", ".unv"):
        raise InputError(target, "", "frequency responses are written to universal files", "end OUT in .uff")
    refuse_existing(target, overwrite=overwrite)
    run = read_as(source, formats=formats())
    found = frequency_responses(run, resolution_Hz=resolution_Hz)
    names = list(dict.fromkeys(each.sweep for each in found))
    if sweep is not None and sweep not in names:
        raise InputError(
            "--sweep", "", f"no sweep {sweep[:60]!r} has frequency responses", f"there are {', '.join(names)}"
        )
    chosen = [each for each in found if sweep in (None, each.sweep)]
    write_universal(chosen, target, run=run, overwrite=overwrite)
    return [
        f"sweep {each.sweep}: {each.frf_form} of {', '.join(channel.name for channel in each.responses)}, "
        f"{len(each.frequency_Hz)} frequencies from {each.frequency_Hz[0]:g} to {each.frequency_Hz[-1]:g} Hz"
        for each in chosen
    ]
