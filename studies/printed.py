"""A reproduced study as tables on a terminal: its frequencies, parameters, causes, elements and sweeps."""

import math
from typing import Any

from studies.reproduction import Reproduction
from twin.views.table import Table


def tables(result: Reproduction) -> list[Table]:
    """Those of them that have rows."""
    every = (_frequencies(result), _parameters(result), _candidates(result), _elements(result), _residuals(result))
    return [table for table in every if table.rows]


def _frequencies(result: Reproduction) -> Table:
    rows = []
    for condition, here in result.this_model.items():
        paper, errors = result.published_model.get(condition), result.error_percent
        for i, frequency in enumerate(here):
            printed = (f"{paper[i]:.2f}", f"{errors['published_model'][condition][i]:+.3f}") if paper else ("", "")
            ours = (f"{frequency:.2f}", f"{errors['this_model'][condition][i]:+.3f}")
            rows.append((condition, str(i + 1), f"{result.measured[condition][i]:.2f}", *printed, *ours))
    return Table(
        caption=f"Natural frequencies (Hz), {result.free_parameters} free parameters here",
        head=("", "mode", "measured", "paper", "error %", "here", "error %"),
        rows=rows,
        numbers=range(1, 7),
    )


def _parameters(result: Reproduction) -> Table:
    intervals = result.identifiability.get("profile_95", {})
    rows = []
    for name, entry in result.parameters.items():
        interval = " .. ".join(map(_open, intervals[name])) if name in intervals else ""
        std = f"{entry['std']:.2g}" if entry["std"] < abs(entry["value"]) else "open"
        paper = f"{result.published_parameters[name]:.4g}" if name in result.published_parameters else ""
        rows.append((name, f"{entry['value']:.4g}", std, interval, paper))
    head = ("parameter", "here", "std", "95 % interval", "paper")
    return Table(caption="Parameters", head=head, rows=rows, numbers=range(1, 5))


def _open(bound: float | None) -> str:
    return f"{bound:.3g}" if bound and math.isfinite(bound) else "open"


def _candidates(result: Reproduction) -> Table:
    rows = []
    for item in sorted(result.candidates, key=lambda c: c.bic):
        parameters = ", ".join(f"{key} {entry['value']:.4g}" for key, entry in item.parameters.items())
        errors = (f"{item.rms_percent:.3f}", f"{item.worst_percent:.3f}", f"{item.bic:.1f}")
        rows.append((item.cause, parameters, str(item.free_parameters), *errors))
    head = ("cause", "parameters", "free", "rms %", "worst %", "BIC")
    return Table(caption="Causes tried (BIC: lower is better supported)", head=head, rows=rows, numbers=range(2, 6))


def _elements(result: Reproduction) -> Table:
    choice: dict[str, dict[str, Any]] = result.details.get("element_choice", {})
    names = list(next(iter(choice.values()))["parameters"]) if choice else []
    rows = [
        (element, *(f"{entry['parameters'][name]['value']:.4g}" for name in names), f"{entry['worst_percent']:.3f}")
        for element, entry in choice.items()
    ]
    return Table(
        caption="The layer's element: what the choice changes",
        head=("element", *names, "worst %"),
        rows=rows,
        numbers=range(1, len(names) + 2),
    )


def _residuals(result: Reproduction) -> Table:
    columns = {
        "paper": "published", "own law": "this_model", "one law for all forces": "one_law_for_all_forces",
        "law of the other forces": "left_out_at_force",
    }  # fmt: skip
    rows = [
        (sweep, *(f"{entry[key]:.2f}" if key in entry else "" for key in columns.values()))
        for sweep, entry in result.residual_percent.items()
    ]
    return Table(
        caption="Nonlinear sweeps: residual of the complex response (%)",
        head=("sweep", *columns),
        rows=rows,
        numbers=range(1, 5),
    )
