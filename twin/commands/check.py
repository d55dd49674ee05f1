"""`twin check`: are recordings sound, do they fit a rig, and what can be got out of one that is damaged."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from twin.commands.common.options import FILE, json_option, overwrite_option
from twin.commands.common.output import next_step, print_json, say, working

if TYPE_CHECKING:
    from recordings.check import CheckReport
    from recordings.recover import RecoverReport

LISTED = 20
"""Problems printed for people; --json has them all."""


@click.command(name="check")
@click.argument("runs", metavar="RUN...", nargs=-1, required=True, type=FILE)
@click.option(
    "--rig", "rig_name", metavar="RIG", help="A shipped rig's name or a TOML file, which the runs are looked at beside."
)
@click.option("--recover", "out", type=FILE, help="Write what is still complete to this new file.")
@overwrite_option
@json_option
def command(runs: tuple[Path, ...], rig_name: str | None, out: Path | None, overwrite: bool, as_json: bool) -> int:
    """Check RUNs (.mcap) against the recording contract; a .csv is checked as a table of sweeps or of modes.

    With a RIG, sound recordings are looked at beside it, without a fit: units, channels that are swapped, turned or
    dead, time base, runs that are the same or of another specimen.

    Exit status 0 if all is sound, 1 if a run is damaged, breaks the contract or shows what should stop a fit, 2 if it
    is not there or no MCAP file (or a table that cannot be used).
    """
    tables = [run for run in runs if run.suffix.lower() == ".csv"]
    if out and (tables or len(runs) > 1):
        raise click.UsageError("--recover is for one .mcap file")
    if tables and (rig_name or len(runs) > 1):
        raise click.UsageError("a table is checked by itself, without a rig")
    if tables:
        _check_table(tables[0], as_json)
        return 0

    from recordings.check import check_run
    from recordings.recover import recover
    from twin.lab import load_rig

    rig = load_rig(rig_name) if rig_name else None
    with working(f"checking {', '.join(run.name for run in runs)}") as begin:
        reports = [check_run(run) for run in runs]
        recovered = recover(runs[0], out, overwrite=overwrite) if out else None
        whole = all(report.sound for report in reports)
        if rig is not None:
            begin("a first look beside the rig")
        looked = rig.check(runs) if rig is not None and whole else None
    sound = whole and not (looked and looked.stopped)
    if as_json:
        seen = {"findings": [asdict(finding) for finding in looked.findings]} if looked else {}
        one = asdict(reports[0]) if len(runs) == 1 else {"runs": [asdict(report) for report in reports]}
        print_json({**one, "sound": sound, "recovered": asdict(recovered) if recovered else None, **seen})
        return int(not sound)
    for finding in looked.findings if looked else ():
        say(f"{finding.action}: {finding.line}")
    for report in reports:
        _print_report(report)
    if recovered:
        _print_recovered(recovered)
    elif not whole:
        damaged = next(run for run, report in zip(runs, reports, strict=True) if not report.sound)
        next_step(f"twin check {damaged} --recover {damaged.with_name(damaged.stem + '-whole.mcap')}")
    return int(not sound)


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
