"""`twin speed`: the benchmark ratios on this machine, each with its promise and the error at which it holds."""

import math
from typing import Any

import click

from twin.commands.common.options import json_option
from twin.commands.common.output import print_json, progress_bar, say, stage


@click.command("speed")
@click.option("--only", multiple=True, metavar="NAME", help="Measure this line alone; several times for several.")
@json_option
def command(only: tuple[str, ...], as_json: bool) -> None:
    """Measure the benchmark ratios on this machine.

    Both sides run in turns on one thread, and their processor time is compared, so that other work on the machine
    counts little; compilation is not counted.  The line `start` and those of wires are of real time; `start` compiles,
    which takes a minute.
    """
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
