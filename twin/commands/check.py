"""`twin check`: is a recording sound, and what can be got out of it if it is not."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from twin.commands.output import console, json_option, print_json

if TYPE_CHECKING:
    from recordings.check import CheckReport
    from recordings.recover import RecoverReport

__all__ = ["command"]

LISTED = 20
"""Problems printed for people; --json has them all."""


@click.command(name="check")
@click.argument("run", type=click.Path(path_type=Path))
@click.option(
    "--recover", "out", type=click.Path(path_type=Path), help="Write what is still complete to this new file."
)
@json_option
def command(run: Path, out: Path | None, as_json: bool) -> int:
    r"""Check RUN, an .mcap, against the recording contract.

    Exit status 0 if it is sound, 1 if it is damaged or breaks the contract, 2 if it is not there or no MCAP file.

    \b
    Examples:
      twin check run.mcap
      twin check cut.mcap --recover whole.mcap
    """
    from dataclasses import asdict

    from recordings.check import check_run
    from recordings.recover import recover

    report = check_run(run)
    recovered = recover(run, out) if out else None
    if as_json:
        print_json({**asdict(report), "recovered": asdict(recovered) if recovered else None})
    else:
        _print_report(report)
        if recovered:
            _print_recovered(recovered)
    return 0 if report.sound else 1


def _print_report(report: CheckReport) -> None:
    """For people, on standard error."""
    for problem in report.problems[:LISTED]:
        console.print(f"{problem.kind}: {problem.place}: {problem.reason}", markup=False, soft_wrap=True)
    more = len(report.problems) - LISTED + report.problems_not_listed
    if more > 0:
        console.print(f"and {more} more; --json lists them", markup=False)
    for channel in report.channels:
        console.print(
            f"{channel.name} ({channel.quantity}, {channel.unit}, device {channel.device}): {channel.samples} samples, "
            f"{channel.lost} lost in {channel.gaps} gaps, {channel.overload} overloaded",
            markup=False, soft_wrap=True,
        )  # fmt: skip
    events = ", ".join(f"{count} {kind}" for kind, count in report.events.items()) or "none"
    console.print(f"{report.steps} step messages, events: {events}, {report.duration_s:.3f} s", markup=False)
    if not report.sound:
        lost = ", ".join(f"{count} of {topic}" for topic, count in report.messages_lost.items())
        known = f", with messages {lost}" if lost else ""
        console.print(f"{report.bytes_lost} bytes could not be read{known}", markup=False, soft_wrap=True)
    console.print(f"{report.path}: {'sound' if report.sound else 'NOT sound'}", markup=False, soft_wrap=True)


def _print_recovered(recovered: RecoverReport) -> None:
    kept = ", ".join(f"{count} of {topic}" for topic, count in recovered.kept.items()) or "none"
    console.print(f"{recovered.path}: messages recovered: {kept}", markup=False, soft_wrap=True)
    if recovered.set_aside:
        aside = ", ".join(f"{count} in {topic}" for topic, count in recovered.set_aside.items())
        console.print(f"set aside, because they break the contract: {aside}", markup=False, soft_wrap=True)
    for note in recovered.notes:
        console.print(note, markup=False, soft_wrap=True)
    if not recovered.sound:
        console.print(f"{recovered.path} still breaks the contract; run 'twin check' on it", markup=False)
