"""Pictures of a rehearsal, from its table (``result.json``)."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from twin.identify.spectra.resonances import by_resonance
from twin.views.drawing import dressed, panels
from twin.views.figures import plots_figure
from twin.views.plot import Plot, PlotCurve
from twin.views.style import INK, level_colour

Rows = Sequence[Mapping[str, Any]]

LEGEND_COLUMNS = 4
"""As many names of sweeps as fit beside each other."""


def responses_figures(
    steps: Rows, branches: Rows, channels: Sequence[str], force: str | None
) -> list[tuple[Figure, Rows]]:
    """A :func:`responses_figure` about each resonance that was swept, with the steps that it shows."""
    swept = [step for step in steps if step["frequency_Hz"]]
    found: list[tuple[Figure, Rows]] = []
    for group in by_resonance(np.array([step["frequency_Hz"] for step in swept])):
        about = [swept[i] for i in group]
        low, high = (end(step["frequency_Hz"] for step in about) for end in (min, max))
        near = [b for b in branches if any(low <= f <= high for f in b["frequency_Hz"])]
        figure = responses_figure(about, near, channels, force)
        if figure is not None:
            found.append((figure, about))
    return found


def responses_figure(steps: Rows, branches: Rows, channels: Sequence[str], force: str | None) -> Figure | None:
    """Response per force at every step over the predicted branches; a panel a channel, a colour a level."""
    shown = [step for step in steps if step["frequency_Hz"] and step["phasors"]]
    if not shown or not channels:
        return None
    colours = {level: level_colour(i) for i, level in enumerate(dict.fromkeys(s["target_amplitude"] for s in shown))}
    told = [("predicted branch", INK, "line")] if branches else []
    if any(not all(branch.get("stable", [])) for branch in branches):
        told.append(("unstable", INK, "dotted"))
    per, plots = f" / |{force}|, SI units" if force else "", []
    for channel in channels:
        near = [branch for branch in branches if branch["force_N"] in colours and channel in branch["response"]]
        curves = [curve for one in near for curve in _branch_curves(one, channel, colours[one["force_N"]])]
        for sweep in dict.fromkeys(step["sweep"] for step in shown):
            rows = [step for step in shown if step["sweep"] == sweep]
            x = np.array([row["frequency_Hz"] for row in rows])
            y = np.array([_amplitude(row, channel) / (_amplitude(row, force) if force else 1.0) for row in rows])
            # Which way it went: both ways lie on each other where all is well.
            kind = next((way for way in ("up", "down") if sweep.endswith(f"-{way}")), "point")
            colour = colours[rows[0]["target_amplitude"]]
            curves.append(PlotCurve(f"{sweep}, each step", x, y, colour, kind, 3.3, legend=True))
        plots.append(Plot.over(channel, "frequency, Hz", f"|{channel}|{per}", curves, told=told))
    return plots_figure(plots, columns=len(plots), height_in=3.0, legend_columns=LEGEND_COLUMNS)


def _branch_curves(branch: Mapping[str, Any], channel: str, colour: str) -> Iterator[PlotCurve]:
    """A predicted curve per force in parts, dotted where no rig can stay."""
    x = np.array(branch["frequency_Hz"])
    y = np.array(branch["response"][channel]["amplitude"]) / branch["force_N"]
    stays = np.array(branch.get("stable") or np.ones(len(x), bool))
    begin = 0
    for end in np.append(np.flatnonzero(np.diff(stays)) + 1, len(x)):
        # Each part goes on to the next one's first point, so that the curve has no gaps.
        part = slice(begin, end + 1)
        yield PlotCurve("", x[part], y[part], colour, "line" if stays[begin] else "dotted", 1.5)
        begin = end


def range_figure(steps: Rows) -> Figure | None:
    """Use of each converter's range, and the time each step takes, in the order of the steps."""
    names = list(dict.fromkeys(name for step in steps for name in step["range_use"]))
    if not names or len(steps) < 2:
        return None
    figure, ((left, right),) = panels(1, 2, height_in=3.0)
    number = np.arange(1, len(steps) + 1)
    for i, name in enumerate(names):
        use = [100 * step["range_use"].get(name, np.nan) for step in steps]
        marker = "o" if len(steps) <= 20 else ""  # a step alone has no line
        left.semilogy(number, use, color=level_colour(i), label=name, linewidth=1.4, marker=marker, markersize=4)
    left.axhline(100.0, color=INK, linewidth=0.9)
    dressed(left, title="use of the converter's range", xlabel="step", ylabel="peak, % of the range")
    settle = np.array([step["settle_s"] for step in steps], float)
    measure = np.array([step["measure_s"] for step in steps], float)
    edges = np.arange(len(steps) + 1) + 0.5
    right.stairs(settle, edges, fill=True, color="#e69f00", label="settling")
    right.stairs(settle + measure, edges, baseline=settle, fill=True, color="#0072b2", label="measuring")
    dressed(right, title="time of each step", xlabel="step", ylabel="time, s")
    for axes in (left, right):
        axes.set_xlim(edges[0], edges[-1])
        axes.xaxis.set_major_locator(MaxNLocator(6, integer=True))
        # above the axes, where nothing that is drawn can hide it
        axes.legend(loc="lower center", bbox_to_anchor=(0.5, 1.1), ncols=LEGEND_COLUMNS, frameon=False, fontsize=9)
    return figure


def noise_figure(noise: Mapping[str, Any]) -> Figure:
    """Densities, responses and coherence of a stretch of noise, one above the other."""
    channels = list(noise["density"])
    labels = {
        "density": "spectral density, unit²/Hz", "response": "response per force, SI units", "coherence": "coherence",
    }  # fmt: skip
    plots = []
    for what, label in labels.items():
        frequency_Hz, curves = np.array(noise["frequency_Hz"]), []
        for name, values in noise[what].items():
            colour = level_colour(channels.index(name))
            curves.append(PlotCurve(name, frequency_Hz, np.array(values), colour, size=1.2, legend=True))
        plots.append(Plot.over("", "frequency, Hz", label, curves, log="" if what == "coherence" else "y"))
    return plots_figure(plots, columns=1, height_in=1.9, sharex=True, height_ratios=[3, 3, 2])


def _amplitude(step: Mapping[str, Any], channel: str) -> float:
    value = step["phasors"].get(channel, {}).get("amplitude")
    return float(value) if value else np.nan
