"""`twin speed`: the benchmark ratios on this machine, each with its promise and the error at which it holds."""

import math
from pathlib import Path
from typing import Any

import click

from recordings.whole import check_writable
from twin.commands.common.options import json_option, overwrite_option
from twin.commands.common.output import print_json, progress_bar, say, stage


@click.command("speed")
@click.option("--only", multiple=True, metavar="NAME", help="Measure this line alone; several times for several.")
@click.option("--scaling", is_flag=True, help="Measure cost against size, beside the strongest peers, instead.")
@click.option(
    "--page",
    type=click.Path(path_type=Path, dir_okay=False),
    metavar="FILE",
    help="With --scaling: write the tables there as Markdown, and their picture into a folder beside it.",
)
@overwrite_option
@json_option
def command(only: tuple[str, ...], scaling: bool, page: Path | None, overwrite: bool, as_json: bool) -> None:
    """Measure the benchmark ratios on this machine.

    Both sides run in turns on one thread, and their processor time is compared, so that other work on the machine
    counts little; compilation is not counted.  The line `start` and those of wires are of real time; `start` compiles,
    which takes a minute.

    With --scaling each work is measured at several sizes beside what a specialist would write by hand for it, as often,
    and the exponents of cost over size are fitted; then what memory a recording's length costs.  That takes four
    minutes.
    """
    if page and not scaling:
        raise click.UsageError("--page goes with --scaling")
    check_writable(page, overwrite=overwrite)
    if scaling:
        _scaling(only, page, as_json)
        return
    from benchmarks.lines import BENCHMARKS
    from benchmarks.measured import MissingRivalError

    unknown = [name for name in only if name not in BENCHMARKS]
    if unknown:
        raise click.UsageError(f"--only: no line {unknown[0]!r}; there are {', '.join(BENCHMARKS)}")
    results: dict[str, Any] = {}
    with progress_bar() as bar:
        task = bar.add_task("", total=len(only or BENCHMARKS))
        for name in only or BENCHMARKS:
            bar.update(task, description=name)
            stage(f"measuring {name}")
            try:
                results[name] = BENCHMARKS[name]().table()
            except MissingRivalError as error:
                results[name] = {"ratio": None, "promise": None, "against": str(error), "error": None, "threads": 1}
            bar.advance(task)
            if not as_json:
                say(_line(name, results[name]))
    if as_json:
        print_json(results)


def _scaling(only: tuple[str, ...], page: Path | None, as_json: bool) -> None:
    from benchmarks.memory import memory_over_length
    from benchmarks.scaled_works import WORKS
    from benchmarks.scaling_page import write_page

    names = [*WORKS, "memory"]
    if unknown := [name for name in only if name not in names]:
        raise click.UsageError(f"--only: no work {unknown[0]!r}; there are {', '.join(names)}")
    if page and only:
        raise click.UsageError("--page has all works; leave --only out")
    works, memory = {}, []
    for name in only or names:
        stage(f"measuring {name}")
        if name == "memory":
            memory = [each.table() for each in memory_over_length()]
        else:
            works[name] = WORKS[name]().table()
        if not as_json:
            say("\n".join(_stage_lines(memory) if name == "memory" else _work_lines(name, works[name])))
    if page:
        write_page(page, works, memory)
    if as_json:
        print_json({"works": works, "memory": memory})


def _work_lines(name: str, work: dict[str, Any]) -> list[str]:
    held = "held" if work["held"] else "NOT held"
    return [
        f"{name}: {work['limit']}: {held}; exponent {work['exponent']:.2f}, of {work['against']} "
        f"{work['exponent_of_the_other']:.2f}",
        *(
            f"  {c['size']} {work['sized']}: {1e6 * c['ours_s']:.3g} us a {work['per']}, the other {c['ratio']:.2g} "
            f"times as long, error {c['error']:.1g}"
            for c in work["costs"]
        ),
    ]


def _stage_lines(memory: list[dict[str, Any]]) -> list[str]:
    return [
        f"memory, {m['stage']}: {m['longer_MB']:.0f} MB, {m['hour_MB']:.0f} MB for an hour: "
        f"{'held' if m['held'] else 'NOT held'}"
        for m in memory
    ]


def _line(name: str, row: dict[str, Any]) -> str:
    if row["ratio"] is None:
        return f"{name}: not measured, {row['against']}"
    promise = f" (promised {row['promise']:g})" if row["promise"] else ""
    digits = max(0, 1 - math.floor(math.log10(row["ratio"])))
    line = f"{name}: {row['ratio']:.{digits}f} times {row['against']}{promise}, error {row['error']:.1g}"
    usual = {"ratio", "promise", "against", "error", "threads"}
    more = {
        key: f"{value:.3g}" if isinstance(value, float) else value for key, value in row.items() if key not in usual
    }
    return line + "".join(f", {key} {value}" for key, value in more.items())
