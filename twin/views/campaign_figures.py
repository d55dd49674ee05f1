"""Pictures of a campaign: what was taken for what, and from which size on an effect is found."""

from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twin.campaign.summary import CampaignSummary
from twin.views.drawing import heat_map


def confusion_figure(summary: CampaignSummary) -> Figure:
    """Hidden causes of normal strength in rows, what was named first in columns; a cell's number counts cases."""
    rows = list(summary.confusion)
    named = {name for counts in summary.confusion.values() for name in counts}
    columns = [row for row in rows if row in named] + sorted(named - set(rows))
    counts = np.array([[summary.confusion[row].get(column, 0) for column in columns] for row in rows], int)
    counts = counts.reshape(len(rows), len(columns))
    figure, axes = _grid(len(rows), len(columns))
    shares = counts / np.maximum(counts.sum(axis=1, keepdims=True), 1)
    heat_map(axes, shares, np.where(counts > 0, counts.astype(str), ""), rows=rows, columns=columns, rotation=90)
    axes.set(xlabel="named first", ylabel="hidden", title="What was named, by what was hidden")
    return figure


def detection_figure(summary: CampaignSummary) -> Figure:
    """Share of cases found, by cause and strength; each cell says how many of how many."""
    shown = [row for row in summary.rows if row.label != "none" and "+" not in row.label]
    rows = list(dict.fromkeys(row.label for row in shown))
    columns = sorted({row.strength for row in shown})
    shares, texts = np.full((len(rows), len(columns)), np.nan), np.full((len(rows), len(columns)), "", object)
    for row in shown:
        at = rows.index(row.label), columns.index(row.strength)
        shares[at], texts[at] = row.found / row.cases, f"{row.found}/{row.cases}"
    figure, axes = _grid(len(rows), 2 * len(columns))
    heat_map(axes, shares, texts, rows=rows, columns=[f"{strength:g}" for strength in columns])
    axes.set(xlabel="strength, of normal", ylabel="hidden", title="Found (first, or in the set)")
    return figure


def _grid(rows: int, columns: int) -> tuple[Figure, Any]:
    width, height = (margin + 0.28 * max(count, 4) for margin, count in zip((3.0, 2.4), (columns, rows), strict=True))
    figure = Figure(figsize=(width, height), layout="constrained")
    return figure, figure.add_subplot()
