"""``twin diagnose``: what the model gets wrong, the cause, the extended model, the gain."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from recordings.staging import staged_folder
from twin.commands.common.options import (
    FILE,
    causes_option,
    json_option,
    laws_option,
    overwrite_option,
    scatter_option,
    time_limit_option,
)
from twin.commands.common.output import (
    console,
    next_step,
    print_json,
    print_tables,
    say,
    tell_assumed,
    trace,
    typed,
    working,
    write_json,
)

if TYPE_CHECKING:
    from twin.lab.diagnosed import DiagnosedRecordings
    from twin.lab.diagnosed_tables import DiagnosedTables

REPORT, RESULT = "report.html", "result.json"
RESULTS = (REPORT, RESULT, "extended.toml", "extended-*", "next.toml", "view.rrd")
HELD_OUT = "--held-out"


class _HeldOutRuns(click.Command):
    """All words that follow ``--held-out``, up to the next option, are runs that are held out."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Say the option again before each of them."""
        spread: list[str] = []
        held = False
        for before, word in zip(["", *args], args, strict=False):
            if word.startswith("-"):
                held = word == HELD_OUT
            elif held and before != HELD_OUT:
                spread.append(HELD_OUT)
            spread.append(word)
        return super().parse_args(ctx, spread)


@click.command(cls=_HeldOutRuns, name="diagnose")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=FILE)
@click.option("--rig", "rig_name", required=True, metavar="RIG", help="A shipped rig's name or a TOML file.")
@click.option(
    "--preload", "preloads", metavar="NAME", multiple=True,
    help="Name of the rig's preload; by default the recording's, or the table's own column. Once for each table.",
)  # fmt: skip
@click.option(
    HELD_OUT, "held_out", metavar="RUN...", multiple=True, type=FILE,
    help="Runs kept for the gain: all words up to the next option.",
)  # fmt: skip
@click.option("--out", required=True, type=FILE, help="Folder for result, report and pictures.")
@time_limit_option
@scatter_option
@click.option(
    "--exclude", metavar="CAUSE", multiple=True,
    help="A cause that the next test is to show or to exclude, at the size at which it could hide now.",
)  # fmt: skip
@click.option("--thorough", is_flag=True, help="Fit more rivals, from more beginnings and for longer.")
@overwrite_option
@causes_option
@laws_option
@json_option
def command(
    runs: tuple[Path, ...],
    rig_name: str,
    preloads: tuple[str, ...],
    held_out: tuple[Path, ...],
    out: Path,
    time_limit_s: float,
    frequency_scatter: float | None,
    exclude: tuple[str, ...],
    thorough: bool,
    overwrite: bool,
    as_json: bool,
) -> int:
    """Say what the model of RIG gets wrong about the measured RUNs.

    RUNs are recordings (.mcap), frequency responses of one state (.uff, .unv, .npz, .csv) or tables (.csv), one kind
    at a time.  Frequency responses have no force level: of these, linear causes only are named.  A table of natural
    frequencies has the columns mode, frequency_Hz, and may have std_Hz and preload; its RIG is any structure, or a
    beam alone such as composite-beam.  Modes count from 1: those of bending where all beams lie in one row, else all.
    A table of sweeps that held their response has the columns level, frequency_Hz, force_N, acceleration_m_per_s2 (or
    velocity_m_per_s, displacement_m), phase_rad; of its RIG, such as brake-reuss, only the name and the channel's are
    taken.

    What RIG says is not found again: with the extended.toml of an earlier diagnosis only what is new is.

    Ends with status 1 where the data stay unexplained: a verdict of unknown or ambiguous, or an error on what was held
    out that is still several times its noise or has grown.
    """
    from twin.diagnose import DiagnosisOptions, usual_processes
    from twin.lab import load_rig

    rig = load_rig(rig_name)
    options = DiagnosisOptions(
        thorough=thorough, exclude=exclude, time_limit_s=time_limit_s, processes=usual_processes()
    )
    with working("reading") as begin, staged_folder(out, results=RESULTS, overwrite=overwrite) as folder:
        found = rig.diagnose(
            runs, held_out=held_out, preload=preloads, out=folder, frequency_scatter=frequency_scatter,
            options=options, report=begin,
        )  # fmt: skip
        data = found.save_model(folder)
        write_json(data, folder / RESULT)
        begin("writing the report and the pictures")
        drawn = _draw(found, folder, files=(rig_name, *map(str, (*runs, *held_out))))
    if as_json:
        print_json(data)
    else:
        _tell(found, data, out, [RESULT, data["extended_model"], *drawn])
    return int(not data["explains"])


def _draw(found: DiagnosedRecordings | DiagnosedTables, out: Path, *, files: Sequence[str]) -> list[str]:
    """Write report and view beside a result that stands without them; names of those that could be drawn."""
    from twin.lab.diagnosed import VIEW, DiagnosedRecordings

    drawn = []
    drawings: dict[str, Callable[[Path], None]] = {
        REPORT: lambda path: found.report(path, commands=[typed()], files=files)
    }
    if isinstance(found, DiagnosedRecordings):
        drawings[VIEW] = found.save_view
    for name, draw in drawings.items():
        try:
            draw(out / name)
        except Exception as error:  # whatever a picture lacks
            trace()
            say(f"warning: {name} could not be drawn ({error}); {RESULT} is complete without it")
        else:
            drawn.append(name)
    return drawn


def _tell(found: DiagnosedRecordings | DiagnosedTables, data: dict[str, Any], out: Path, files: Sequence[str]) -> None:
    """The answer for a person."""
    from twin.views.reports.answer import causes_table

    tell_assumed(data["assumed"])
    say((data["answer"], "bold"))
    misfit = data["misfit"]
    say(
        f"misfit: chi2 per degree of freedom {misfit['chi2_per_dof']:.3g} before, {misfit['after']:.3g} after "
        f"(agreement up to {misfit['threshold']:.3g})"
    )
    if data["causes"]:
        print_tables(causes_table(found.diagnosis.causes), to=console)
    for cause in found.diagnosis.causes:
        if cause.in_model and cause.advice:
            say(f"{cause.cause}, on the rig: {cause.advice}")
    limits = [limit for limit in found.diagnosis.excluded if limit.limit_95 is not None][:3]  # the report has them all
    if data["verdict"] == "none" and limits:
        told = "; ".join(f"{limit.cause}, {limit.in_words}" for limit in limits)
        say(f"at most this could hide (95 %): {told}")
    if data["gain"]:
        held = data["gain"]["held_out"]
        where = ", ".join(data["gain"].get("runs") or data["gain"]["sweeps"]) or data["gain"].get("how", "")
        say(
            f"held out ({where}): relative error {held['before']:.3g} before, "
            f"{held['after']:.3g} after, noise floor {held['noise_floor']:.2g}"
        )
    for note in data["notes"]:
        say(f"note: {note}")
    written = ", ".join(str(out / name) for name in files)
    say(f"written: {written}; {data['seconds']:.0f} s")
    test = data["next_test"]
    if test and test.get("procedure"):
        next_step(f"run {out / test['procedure']}, which {test['why']}, and diagnose with that recording too")
    elif REPORT in files:
        next_step(f"open {out / REPORT} in a browser, for the figures behind this")
