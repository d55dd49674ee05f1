"""Pictures of models beside measurements, drawn without a screen; the caller saves or shows them."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.measured_data import MeasuredData
from twin.views.curves import Fitted, each_resonance
from twin.views.drawing import dressed, entry, legend, log_ticks, panels
from twin.views.plot import Plot
from twin.views.plots import broadband_plots, law_plots, sweep_colours, sweep_plots
from twin.views.style import INK

LINES: dict[str, dict[str, Any]] = {
    "line": {"linestyle": "-"},
    "dashed": {"linestyle": (0, (4, 2.5))},
    "dotted": {"linestyle": (0, (1, 2))},
    "point": {"linestyle": "none", "marker": "o"},
    "up": {"linestyle": "none", "marker": "^"},
    "down": {"linestyle": "none", "marker": "v"},
    "": {"linewidth": 4},
}
"""By a curve's kind; an entry of a legend without any tells a colour."""
SHADE = "#e6e6e6"
"""Of amplitudes that were not measured."""


def draw_plot(axes: Axes, plot: Plot) -> None:
    """A plot without the legend's further entries."""
    for low, high in plot.unmeasured:
        axes.axvspan(low, high, color=SHADE, linewidth=0, zorder=0.4)
    for curve in plot.curves:
        style = {**LINES[curve.kind], "markersize": 1.1 * curve.size, "linewidth": 0.8 * curve.size}
        label = curve.name if curve.legend else None
        if curve.std is not None:
            label = f"{curve.name}, ± one standard deviation"
            ends = curve.y - curve.std, curve.y + curve.std
            axes.fill_between(curve.x, *ends, color=curve.colour, alpha=0.22, linewidth=0)
        axes.plot(curve.x, curve.y, color=curve.colour, label=label, **style)
    scales = {name: "log" if axis.log else "linear" for name, axis in (("xscale", plot.x), ("yscale", plot.y))}
    axes.set(**scales, xlim=plot.x.ends, ylim=plot.y.ends)
    dressed(axes, title=plot.title, xlabel=plot.x.label, ylabel=plot.y.label)
    for drawn, axis in ((axes.xaxis, plot.x), (axes.yaxis, plot.y)):
        if axis.log:
            log_ticks(drawn)


def plots_figure(
    plots: Sequence[Plot], *, columns: int, height_in: float, legend_columns: int = 7, **options: Any
) -> Figure:
    """Plots row by row, each row `height_in` high, with one legend for all; `options` as for matplotlib's ``subplots``.

    Where plots share their horizontal axes, the lowest tell what it is.
    """
    rows, columns = -(-len(plots) // columns), min(columns, len(plots))
    figure, grid = panels(rows, columns, height_in=0.6 + height_in * rows, **options)
    for axes in grid.flat[len(plots) :]:
        axes.set_visible(False)
    for number, (axes, plot) in enumerate(zip(grid.flat, plots, strict=False)):
        bare = options.get("sharex") and number < (rows - 1) * columns
        draw_plot(axes, replace(plot, x=replace(plot.x, label="")) if bare else plot)
    told: list[Any] = [entry(text, colour, **LINES[kind]) for plot in plots for text, colour, kind in plot.told]
    if any(plot.unmeasured for plot in plots):
        told.append(Patch(facecolor=SHADE, label="no step reached this"))
    legend(figure, told, columns=legend_columns)
    return figure


def sweeps_figure(
    evidence: MeasuredData, sweeps: Sequence[SweepComparison], *, kinds: Sequence[str], residuals: bool = False
) -> Figure:
    """Receptances and phases, or residuals, of sweeps, as :func:`~twin.views.plots.sweep_plots`.

    A row for each resonance, or two, the phases in the lower one.
    """
    colours = sweep_colours(sweeps)
    rows = []
    for _, _, about in each_resonance(sweeps):
        receptances, phases, left = sweep_plots(evidence, about, colours, kinds)
        rows += [left] if residuals else [receptances, phases]
    heights = [1.0] * len(rows) if residuals else [1.0, 0.6] * (len(rows) // 2)
    height_in = 3.0 * sum(heights) / len(heights)
    plots = [plot for row in rows for plot in row]
    return plots_figure(plots, columns=len(rows[0]), height_in=height_in, height_ratios=heights)


def law_figure(evidence: MeasuredData, models: Mapping[str, Fitted]) -> Figure:
    """Softening over a layer point's opening and loss over its slip, with one standard deviation; any has a law."""
    return plots_figure([*law_plots(evidence, models).values()], columns=2, height_in=3.0)


def broadband_figure(evidence: MeasuredData, models: Mapping[str, Fitted], index: int = 0) -> Figure:
    """Broadband run `index`: responses measured and predicted, and below them the relative errors beside the noise."""
    responses, errors = broadband_plots(evidence, models, index)
    columns = len(responses)
    return plots_figure([*responses, *errors], columns=columns, height_in=2.1, sharex=True, height_ratios=[3, 2])


def bars(axes: Axes, kinds: Sequence[tuple[str, Any, str]], names: Sequence[str], **labels: str) -> None:
    """Bars in groups with `names` below them; each kind is a label, a value for each group and a colour.

    `labels` are the axes', as :func:`~twin.views.drawing.dressed` takes them.
    """
    x, width = np.arange(len(names)), 0.8 / len(kinds)
    for i, (label, values, colour) in enumerate(kinds):
        axes.bar(x - 0.4 + (i + 0.5) * width, values, width=width, color=colour, label=label)
    dressed(axes, **labels)
    axes.set_xticks(x, names)


def error_bars(kinds: Sequence[tuple[str, Any, str]], names: Sequence[str], *, xlabel: str, ylabel: str) -> Figure:
    """Errors in groups about a line at zero, as :func:`bars` takes them."""
    figure, ((axes,),) = panels(1, 1, height_in=3.1)
    bars(axes, kinds, names, xlabel=xlabel, ylabel=ylabel)
    axes.axhline(0.0, color=INK, linewidth=0.8)
    legend(figure)
    return figure
