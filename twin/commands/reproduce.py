"""``twin reproduce``: the papers' tables side by side with this project's."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import asdict
from typing import TYPE_CHECKING, Any

import click

from twin.commands.output import json_option, print_json, standard_output, working

if TYPE_CHECKING:
    from rich.table import Table

    from twin.papers.reproduction import Reproduction

__all__ = ["command"]

STUDIES = ("steel-lap-joint", "composite-beam", "hybrid-joint")


@click.command(short_help="The papers' tables side by side with this project's.")
@click.argument("names", metavar="[" + "|".join(STUDIES) + "]...", nargs=-1, type=click.Choice(STUDIES))
@click.option("--frequencies-only", is_flag=True, help="Leave out the nonlinear sweeps, which take a minute or two.")
@json_option
def command(names: tuple[str, ...], frequencies_only: bool, as_json: bool) -> None:
    """Recompute the papers' tables from their measured frequencies; all three studies unless some are named.

    The nonlinear sweeps are recorded on the bench with laws of the papers' form, and identified from the recordings.
    """
    from twin.papers.studies import reproduce

    chosen = list(dict.fromkeys(names)) or list(STUDIES)
    results = {}
    for name in chosen:
        with working(f"{name}: fitting the measured frequencies"):
            results[name] = reproduce(name, sweeps=not frequencies_only)
    if as_json:
        print_json({name: asdict(result) for name, result in results.items()})
        return
    out = standard_output()
    for name, result in results.items():
        out.rule(f"{name}")
        out.print(f"[dim]{result.source}[/dim]")
        for table in _tables(result):
            out.print(table)
        for note in result.notes:
            out.print(f"- {note}")


def _tables(result: Reproduction) -> Iterator[Table]:
    yield _frequencies(result)
    yield _parameters(result)
    if result.candidates:
        yield _candidates_table(result)
    if "element_choice" in result.details:
        yield _elements(result)
    if result.residual_percent:
        yield _residuals(result)


def _frequencies(result: Reproduction) -> Table:
    from rich.table import Table

    table = Table(title=f"Natural frequencies (Hz), {result.free_parameters} free parameters here")
    for heading in ("", "mode", "measured", "paper", "error %", "here", "error %"):
        table.add_column(heading, justify="left" if not heading else "right")
    for condition, here in result.this_model.items():
        for i, frequency in enumerate(here):
            paper = result.published_model.get(condition, [])
            table.add_row(
                condition if i == 0 else "",
                str(i + 1),
                f"{result.measured[condition][i]:.2f}",
                f"{paper[i]:.2f}" if paper else "",
                f"{result.error_percent['published_model'][condition][i]:+.3f}" if paper else "",
                f"{frequency:.2f}",
                f"{result.error_percent['this_model'][condition][i]:+.3f}",
                end_section=i == len(here) - 1,
            )
    return table


def _parameters(result: Reproduction) -> Table:
    from rich.table import Table

    table = Table(title="Parameters")
    for heading in ("parameter", "here", "std", "95 % interval", "paper"):
        table.add_column(heading, justify="left" if heading == "parameter" else "right")
    intervals = result.identifiability.get("profile_95", {})
    for name, entry in result.parameters.items():
        low, high = intervals.get(name, (None, None))
        interval = "" if name not in intervals else f"{_open(low)} .. {_open(high)}"
        paper = result.published_parameters.get(name)
        std = entry["std"] if entry["std"] < abs(entry["value"]) else None
        table.add_row(
            name, f"{entry['value']:.4g}", "open" if std is None else f"{std:.2g}", interval,
            "" if paper is None else f"{paper:.4g}",
        )  # fmt: skip
    return table


def _open(bound: float | None) -> str:
    return f"{bound:.3g}" if bound and math.isfinite(bound) else "open"


def _candidates_table(result: Reproduction) -> Table:
    from rich.table import Table

    chosen: list[Any] = [cause["cause"] for cause in result.causes]
    table = Table(title="Causes tried (BIC: lower is better supported)")
    for heading in ("cause", "parameters", "free", "rms %", "worst %", "BIC"):
        table.add_column(heading, justify="left" if heading in ("cause", "parameters") else "right")
    for item in sorted(result.candidates, key=lambda c: c.bic):
        parameters = ", ".join(f"{key} {entry['value']:.4g}" for key, entry in item.parameters.items())
        table.add_row(
            item.cause, parameters, str(item.free_parameters), f"{item.rms_percent:.3f}",
            f"{item.worst_percent:.3f}", f"{item.bic:.1f}", style="bold" if item.cause in chosen[:1] else None,
        )  # fmt: skip
    return table


def _elements(result: Reproduction) -> Table:
    from rich.table import Table

    choice: dict[str, dict[str, Any]] = result.details["element_choice"]
    names = list(next(iter(choice.values()))["parameters"])
    table = Table(title="The layer's element: what the choice changes")
    for heading in ("element", *names, "worst %"):
        table.add_column(heading, justify="left" if heading == "element" else "right")
    for element, entry in choice.items():
        values = [f"{entry['parameters'][name]['value']:.4g}" for name in names]
        table.add_row(element, *values, f"{entry['worst_percent']:.3f}")
    return table


def _residuals(result: Reproduction) -> Table:
    from rich.table import Table

    table = Table(title="Nonlinear sweeps: residual of the complex response (%)")
    columns = {
        "sweep": "", "paper": "published", "own law": "this_model", "one law for all forces": "one_law_for_all_forces",
        "law of the other forces": "left_out_at_force",
    }  # fmt: skip
    for heading in columns:
        table.add_column(heading, justify="left" if heading == "sweep" else "right")
    for sweep, entry in result.residual_percent.items():
        table.add_row(sweep, *(f"{entry[key]:.2f}" if key in entry else "" for key in list(columns.values())[1:]))
    return table
