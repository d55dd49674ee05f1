"""Pictures of a campaign: what was taken for what, and from which size on an effect is found."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twin.campaign.summary import CampaignSummary


def confusion_figure(summary: CampaignSummary) -> Figure:
    """Hidden causes of normal strength in rows, what was named first in columns; a cell's number counts cases."""
    rows = list(summary.confusion)
    named = {name for counts in summary.confusion.values() for name in counts}
    columns = [row for row in rows if row in named] + sorted(named - set(rows))
    counts = np.array([[summary.confusion[row].get(column, 0) for column in columns] for row in rows])
    figure, axes = _grid(len(rows), len(columns))
    if counts.size:
        axes.imshow(counts / np.maximum(counts.sum(axis=1, keepdims=True), 1), cmap="Blues", vmin=0, vmax=1)
        for i, j in zip(*np.nonzero(counts), strict=True):
            dark = counts[i, j] > 0.5 * counts[i].sum()
            axes.text(j, i, str(counts[i, j]), ha="center", va="center", fontsize=8, color="white" if dark else "black")
    _labelled(axes, rows, columns)
    axes.set(xlabel="named first", ylabel="hidden", title="What was named, by what was hidden")
    return figure


def detection_figure(summary: CampaignSummary) -> Figure:
    """Share of cases found, by cause and strength; each cell says how many of how many."""
    shown = [row for row in summary.rows if row.label != "none" and "+" not in row.label]
    rows = list(dict.fromkeys(row.label for row in shown))
    columns = sorted({row.strength for row in shown})
    shares = np.full((len(rows), len(columns)), np.nan)
    figure, axes = _grid(len(rows), 2 * len(columns))
    for row in shown:
        i, j = rows.index(row.label), columns.index(row.strength)
        shares[i, j] = row.found / row.cases
        colour = "white" if shares[i, j] > 0.5 else "black"
        axes.text(j, i, f"{row.found}/{row.cases}", ha="center", va="center", fontsize=8, color=colour)
    if shares.size:
        axes.imshow(shares, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    _labelled(axes, rows, [f"{strength:g}" for strength in columns], rotation=0)
    axes.set(xlabel="strength, of normal", ylabel="hidden", title="Found (first, or in the set)")
    return figure


def _grid(rows: int, columns: int) -> tuple[Figure, Any]:
    width, height = (margin + 0.28 * max(count, 4) for margin, count in zip((3.0, 2.4), (columns, rows), strict=True))
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()


def _labelled(axes: Any, rows: list[str], columns: list[str], *, rotation: int = 90) -> None:
    axes.set_xticks(range(len(columns)), columns, rotation=rotation, fontsize=8)
    axes.set_yticks(range(len(rows)), rows, fontsize=8)
    axes.tick_params(length=0)
