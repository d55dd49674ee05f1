"""``twin campaign``: many hidden cases, diagnosed blind, and one table of how well that went."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError
from recordings.staging import staged_folder
from twin.commands.numbers import FiniteRange
from twin.commands.output import console, json_option, print_json, print_tables, progress_bar, say, stage, write_json
from twin.commands.own_code import causes_option, laws_option

if TYPE_CHECKING:
    from twin.campaign import CampaignSummary, CaseResult
    from twin.views.table import Table

SUMMARY, CONFUSION, DETECTION = "campaign.json", "confusion.png", "detection.png"


@click.command(name="campaign", short_help="Hide causes in many virtual rigs and see how well they are found.")
@click.option("--out", required=True, type=click.Path(path_type=Path), help="Folder of the cases and the table.")
@click.option("--rig", "rig_name", default="steel-lap-joint", show_default=True, metavar="RIG", help="As assumed.")
@click.option("--cause", "causes", multiple=True, metavar="NAME", help="Hide this one, or none; repeatable. All.")
@click.option(
    "--seeds", default=10, show_default=True, type=click.IntRange(1), help="Cases of each cause and strength."
)
@click.option("--first-seed", default=1, show_default=True, type=click.IntRange(0, 2**31 - 1), help="Count from here.")
@click.option(
    "--strength", "strengths", multiple=True, default=(1.0,), show_default=True, type=FiniteRange(0.01, 10.0),
    help="Factor on the normal size; repeatable, for the detection map.",
)  # fmt: skip
@click.option("--modes", default=1, show_default=True, type=click.IntRange(1, 3), help="Sweep about the first so many.")
@click.option("--pairs", default=0, show_default=True, type=click.IntRange(0), help="Cases with two causes at once.")
@click.option("--workers", type=click.IntRange(1), help="Local processes; one for each core if left out.")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler to use instead, such as tcp://host:8786.")
@click.option("--keep", is_flag=True, help="Keep the recordings, some 40 MB a case.")
@causes_option
@laws_option
@json_option
def command(
    out: Path,
    rig_name: str,
    causes: tuple[str, ...],
    seeds: int,
    first_seed: int,
    strengths: tuple[float, ...],
    modes: int,
    pairs: int,
    workers: int | None,
    scheduler: str | None,
    keep: bool,
    as_json: bool,
) -> None:
    """Hide causes in virtual rigs, record them, diagnose from the recordings alone, and count.

    Each case draws a cause's size and place, and what no experimenter knows of a rig anyway (E', G', damping, the
    joint's law).  A case takes half a minute to a minute on one core.  Interrupted, the same command goes on where it
    ended, and with more seeds or strengths it adds to what is there.
    """
    from twin.campaign import campaign_causes, planned_cases, run_campaign, summarise
    from twin.rigs import load_rig
    from twin.views.campaign_figures import confusion_figure, detection_figure

    known = (*campaign_causes(), "none")
    for cause in causes:
        if cause not in known:
            raise InputError("--cause", "", f"no cause {cause!r}", f"one of {', '.join(known)}")
    if out.exists() and not out.is_dir():
        raise InputError(out, "", "is not a folder", "name another --out")
    rig = load_rig(rig_name)
    chosen = causes or known
    seeds_used = range(first_seed, first_seed + seeds)
    try:
        plans = planned_cases(causes=chosen, seeds=seeds_used, strengths=strengths, pairs=pairs, modes=modes)
    except ValueError as error:
        raise InputError("--pairs", "", str(error), "give more than one --cause, or none at all") from error
    with progress_bar() as progress:
        task = progress.add_task(f"{len(plans)} cases", total=len(plans))

        def on_result(result: CaseResult) -> None:
            say(_line(result))
            progress.advance(task)

        try:
            results = run_campaign(
                plans, rig, out, workers=workers, scheduler=scheduler, keep=keep, on_result=on_result, report=stage
            )
        except OSError as error:
            raise InputError(out, "", f"cannot be written: {error.strerror or error}", "name another --out") from error
    summary = summarise(results)
    data = summary.to_dict()
    with staged_folder(out, results=(SUMMARY, CONFUSION, DETECTION), overwrite=True) as folder:
        write_json(data, folder / SUMMARY)
        confusion_figure(summary).savefig(folder / CONFUSION, dpi=110, facecolor="white")
        detection_figure(summary).savefig(folder / DETECTION, dpi=110, facecolor="white")
    if as_json:
        print_json(data)
    else:
        print_tables(*_tables(summary), to=console)
        say(f"written: {out / SUMMARY}, {out / CONFUSION}, {out / DETECTION}")


def _line(result: CaseResult) -> str:
    from twin.campaign import judge, named_first

    outcome = judge(result)
    if result.found is None:
        return f"{result.plan.name}: failed: {result.error}"
    text = f"{result.plan.name}: {outcome}, {named_first(result)}"
    if result.found["gain"]:
        held = result.found["gain"]["held_out"]
        text += f", held-out error {held['before']:.2g} before, {held['after']:.2g} after"
    text += "" if result.found.get("explains", True) else ", not explained"
    return f"{text}, {result.found['seconds']:.0f} s"


def _tables(summary: CampaignSummary) -> list[Table]:
    from twin.views.table import Table

    cases = []
    for row in summary.rows:
        other = {k: n for k, n in row.outcomes.items() if k not in ("right", "in a set")}
        cases.append((
            row.label, f"{row.strength:g}", str(row.cases), str(row.found),
            ", ".join(f"{n} {k}" for k, n in other.items()),
            f"{row.resolved}/{row.followed}" if row.followed else "-", str(row.extra), f"{row.inside}/{row.intervals}",
            _number(row.gain), _number(row.oracle_ratio), _number(row.diagnosis_s),
        ))  # fmt: skip
    head = (
        "hidden", "size", "cases", "found", "otherwise", "next test", "extra", "in 95 %", "gain", "/ oracle", "s",
    )  # fmt: skip
    calibration = [
        (f"{e.low:g} to {e.high:g}", str(e.cases), f"{e.mean_probability:.2f}", f"{e.right:.2f}")
        for e in summary.calibration
    ]
    wrong = [
        (label, name, str(count))
        for label, names in summary.confusion.items()
        for name, count in names.items()
        if name != label
    ]
    tables = [
        Table(caption="What was found", head=head, rows=cases, numbers=(1, 2, 3, *range(5, 11))),
        Table(caption="Calibration", head=("probability said", "cases", "mean", "right"), rows=calibration),
        Table(caption="What was taken for what", head=("hidden", "named first", "cases"), rows=wrong),
    ]
    return [table for table in tables if table.rows]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}" if value >= 10 else f"{value:.2g}"
