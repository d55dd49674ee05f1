"""`twin check`: is a recording sound, and what can be got out of it if it is not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from twin.commands.output import json_option, next_step, print_json, say, working

if TYPE_CHECKING:
    from recordings.check import CheckReport
    from recordings.recover import RecoverReport

LISTED = 20
"""Problems printed for people; --json has them all."""


@click.command(name="check")
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--recover", "out", type=click.Path(path_type=Path), help="Write what is still complete to this new file."
)
@json_option
def command(run: Path, out: Path | None, as_json: bool) -> int:
    """Check RUN, an .mcap, against the recording contract; a .csv is checked as a table of sweeps or of modes.

    Exit status 0 if it is sound, 1 if it is damaged or breaks the contract, 2 if it is not there or no MCAP file (or
    a table that cannot be used).
    """
    from dataclasses import asdict

    if run.suffix.lower() == ".csv":
        if out:
            raise click.UsageError("--recover is for .mcap files")
        _check_table(run, as_json)
        return 0

    from recordings.check import check_run
    from recordings.recover import recover

    with working(f"checking {run.name}"):
        report = check_run(run)
    recovered = None
    if out:
        with working(f"recovering {run.name}"):
            recovered = recover(run, out)
    if as_json:
        print_json({**asdict(report), "recovered": asdict(recovered) if recovered else None})
    else:
        _print_report(report)
        if recovered:
            _print_recovered(recovered)
        elif not report.sound:
            next_step(f"twin check {run} --recover {run.with_name(run.stem + '-whole.mcap')}")
    return 0 if report.sound else 1


def _check_table(path: Path, as_json: bool) -> None:
    from recordings.tables import SweepTable, read_table

    table = read_table(path)
    kind = f"sweeps ({table.quantity})" if isinstance(table, SweepTable) else "natural frequencies"
    if as_json:
        print_json({"path": path, "sound": True, "table": kind, "rows": len(table)})
    else:
        say(f"{path}: a table of {kind}, {len(table)} rows, sound")


def _print_report(report: CheckReport) -> None:
    """For people, on standard error."""
    for problem in report.problems[:LISTED]:
        say(f"{problem.kind}: {problem.place}: {problem.reason}")
    more = len(report.problems) - LISTED + report.problems_not_listed
    if more > 0:
        say(f"and {more} more; --json lists them")
    for channel in report.channels:
        say(
            f"{channel.name} ({channel.quantity}, {channel.unit}, device {channel.device}): {channel.samples} samples, "
            f"{channel.lost} lost in {channel.gaps} gaps, {channel.overload} overloaded"
        )  # fmt: skip
    events = ", ".join(f"{count} {kind}" for kind, count in report.events.items()) or "none"
    say(f"{report.steps} step messages, events: {events}, {report.duration_s:.3f} s")
    if not report.sound:
        lost = ", ".join(f"{count} of {topic}" for topic, count in report.messages_lost.items())
        known = f", with messages {lost}" if lost else ""
        say(f"{report.bytes_lost} bytes could not be read{known}")
    say(f"{report.path}: {'sound' if report.sound else 'NOT sound'}")


def _print_recovered(recovered: RecoverReport) -> None:
    kept = ", ".join(f"{count} of {topic}" for topic, count in recovered.kept.items()) or "none"
    say(f"{recovered.path}: messages recovered: {kept}")
    if recovered.set_aside:
        aside = ", ".join(f"{count} in {topic}" for topic, count in recovered.set_aside.items())
        say(f"set aside, because they break the contract: {aside}")
    for note in recovered.notes:
        say(note)
    if not recovered.sound:
        say(f"{recovered.path} still breaks the contract; run 'twin check' on it")
