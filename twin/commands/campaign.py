"""``twin campaign``: many hidden cases, diagnosed blind, and one table of how well that went."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING

import click

from recordings.errors import InputError, blamed_on
from recordings.staging import staged_folder
from twin.commands.common.options import FILE, FiniteRange, causes_option, json_option, laws_option, time_limit_option
from twin.commands.common.output import console, print_json, print_tables, progress_bar, say, stage, write_json

if TYPE_CHECKING:
    from twin.campaign import CampaignSummary, CasePlan, CaseResult, CauseRow, RuleCalibration
    from twin.rigs import Rig
    from twin.views.table import Table

SUMMARY, CONFUSION, DETECTION = "campaign.json", "confusion.png", "detection.png"


@click.command(name="campaign")
@click.option("--out", required=True, type=FILE, help="Folder of the cases and the table.")
@click.option(
    "--rig", "rig_names", multiple=True, default=("steel-lap-joint",), show_default=True, metavar="RIG",
    help="As assumed; repeatable, or all that are shipped: all.",
)  # fmt: skip
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
@click.option(
    "--calibrate", "calibrated", is_flag=True,
    help="Learn the numbers behind the probabilities from every other seed, and judge them on those between.",
)  # fmt: skip
@click.option("--workers", type=click.IntRange(1), help="Local processes; one for each core if left out.")
@click.option("--scheduler", metavar="ADDRESS", help="A Dask scheduler to use instead, such as tcp://host:8786.")
@click.option("--keep", is_flag=True, help="Keep the recordings, some 40 MB a case.")
@time_limit_option
@causes_option
@laws_option
@json_option
def command(
    out: Path,
    rig_names: tuple[str, ...],
    causes: tuple[str, ...],
    seeds: int,
    first_seed: int,
    strengths: tuple[float, ...],
    modes: int,
    pairs: int,
    calibrated: bool,
    workers: int | None,
    scheduler: str | None,
    keep: bool,
    time_limit_s: float,
    as_json: bool,
) -> None:
    """Hide causes in virtual rigs, record them, diagnose from the recordings alone, and count.

    Each case draws a cause's size and place, and what no experimenter knows of a rig anyway (E', G', damping, the
    joint's law).  A case takes a minute or two on one core.  Interrupted, the same command goes on where it
    ended, and with more seeds or strengths it adds to what is there.  With several rigs, each has a folder of its own,
    is given those causes only that it can have, and one table counts by rig and cause.
    """
    from twin.campaign import campaign_causes, fitting_causes, planned_cases, run_campaign, summarise
    from twin.rigs import RIG_FILES, load_rig
    from twin.views.campaign_figures import confusion_figure, detection_figure

    known = (*campaign_causes(), "none")
    for cause in causes:
        if cause not in known:
            raise InputError("--cause", "", f"no cause {cause!r}", f"one of {', '.join(known)}")
    if out.exists() and not out.is_dir():
        raise InputError(out, "", "is not a folder", "name another --out")
    rigs = [load_rig(name) for name in dict.fromkeys(RIG_FILES if "all" in rig_names else rig_names)]
    if len({rig.name for rig in rigs}) < len(rigs):
        raise InputError("--rig", "", "two of these rigs have one name", "give each a name of its own")
    seeds_used = range(first_seed, first_seed + seeds)
    planned: list[tuple[Rig, Path, Sequence[CasePlan]]] = []
    for rig in rigs:
        fitting = fitting_causes(rig, causes or known)
        if left := [cause for cause in causes or known if cause not in fitting]:
            say(f"{rig.name} cannot have: {', '.join(left)}")
        with blamed_on("--pairs", "", "give more than one --cause, or none at all"):
            plans = planned_cases(causes=fitting, seeds=seeds_used, strengths=strengths, pairs=pairs, modes=modes)
        planned.append((rig, out if len(rigs) == 1 else out / re.sub(r"[^\w.-]", "-", rig.name), plans))
    with progress_bar() as progress:
        count = sum(len(plans) for _, _, plans in planned)
        task = progress.add_task(f"{count} cases", total=count)

        def on_result(result: CaseResult) -> None:
            say(_line(result))
            progress.advance(task)

        try:
            results = [
                result
                for rig, folder, plans in planned
                for result in run_campaign(
                    plans, rig, folder,
                    workers=scheduler or workers, keep=keep, time_limit_s=time_limit_s, on_result=on_result,
                    report=stage,
                )
            ]  # fmt: skip
        except OSError as error:
            raise InputError(out, "", f"cannot be written: {error.strerror or error}", "name another --out") from error
    summary = summarise(results)
    by_rig = {rig.name: summarise([r for r in results if r.rig == rig.name]) for rig in rigs}
    calibration = _calibration(results) if calibrated else None
    data = asdict(summary) | {"by_rig": {name: [asdict(row) for row in one.rows] for name, one in by_rig.items()}}
    if calibration is not None:
        data["rule"] = asdict(calibration)
    with staged_folder(out, results=(SUMMARY, CONFUSION, DETECTION), overwrite=True) as folder:
        write_json(data, folder / SUMMARY)
        confusion_figure(summary).savefig(folder / CONFUSION, dpi=110, facecolor="white")
        detection_figure(summary).savefig(folder / DETECTION, dpi=110, facecolor="white")
    if as_json:
        print_json(data)
    else:
        print_tables(*_tables(summary, by_rig if len(by_rig) > 1 else {}), to=console)
        if calibration is not None:
            print_tables(_rule_table(calibration), to=console)
        say(f"written: {out / SUMMARY}, {out / CONFUSION}, {out / DETECTION}")


def _calibration(results: Sequence[CaseResult]) -> RuleCalibration | None:
    """The calibration, or None where that is told to be impossible."""
    from twin.campaign import calibrate

    try:
        return calibrate(results)
    except ValueError as error:
        say(f"not calibrated: {error}; give more --seeds")
        return None


def _rule_table(calibration: RuleCalibration) -> Table:
    from twin.identify.residuals.error_model import SOUND, SPREAD
    from twin.views.table import Table

    numbers = (calibration.in_use, calibration.learnt)
    judged = (calibration.in_use_judged, calibration.learnt_judged)
    rows = [
        ("temperature", *(f"{each.temperature:.2f}" for each in numbers)),
        ("odds of a cause", *(f"{math.exp(each.log_odds_of_a_cause):.2g}" for each in numbers)),
        ("odds of something unknown", *(f"{math.exp(each.log_odds_of_unknown):.2g}" for each in numbers)),
        ("probability of the truth", *(f"{each.of_the_truth:.3f}" for each in judged)),
        ("truth in the set of 95 %", *(f"{each.in_set_95:.3f}" for each in judged)),
        ("size of that set", *(f"{each.set_size:g}" for each in judged)),
        ("calibration error", *(f"{each.calibration_error:.3f}" for each in judged)),
    ]
    if calibration.model_error is not None:
        median, factor = calibration.model_error
        in_use = f"{SOUND.steps.stiffness:.1e}, factor {math.exp(SPREAD):.1f}"
        rows.append(("model error of clean rigs", in_use, f"{median:.1e}, factor {factor:.1f}"))
    judged_on = f"judged on {calibration.in_use_judged.cases} cases"
    caption = f"The rule: learnt from {calibration.learnt_from} cases, {judged_on}"
    return Table(caption=caption, head=("", "in use", "learnt"), rows=rows, numbers=(1, 2))


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


def _row(row: CauseRow) -> tuple[str, ...]:
    other = {k: n for k, n in row.outcomes.items() if k not in ("right", "in a set")}
    return (
        row.label, f"{row.strength:g}", str(row.cases), str(row.found),
        ", ".join(f"{n} {k}" for k, n in other.items()),
        f"{row.resolved}/{row.followed}" if row.followed else "-", str(row.extra), f"{row.inside}/{row.intervals}",
        _number(row.gain), _number(row.oracle_ratio), _number(row.diagnosis_s),
    )  # fmt: skip


def _tables(summary: CampaignSummary, by_rig: Mapping[str, CampaignSummary]) -> list[Table]:
    from twin.views.table import Table

    cases = [_row(row) for row in summary.rows]
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
    few = (0, 1, 2, 3, 4, 6, 7)  # a terminal has room for no more beside the rig's name
    each = [(name, *(_row(row)[n] for n in few)) for name, one in by_rig.items() for row in one.rows]
    tables = [
        Table(caption="By rig and cause", head=("rig", *(head[n] for n in few)), rows=each, numbers=(2, 3, 4, 6, 7)),
        Table(caption="What was found", head=head, rows=cases, numbers=(1, 2, 3, *range(5, 11))),
        Table(caption="Calibration", head=("probability said", "cases", "mean", "right"), rows=calibration),
        Table(caption="What was taken for what", head=("hidden", "named first", "cases"), rows=wrong),
    ]
    return [table for table in tables if table.rows]


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}" if value >= 10 else f"{value:.2g}"
