"""Pictures of a rehearsal, from its table (``result.json``)."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from twin.identify.spectra.resonances import by_resonance
from twin.views.drawing import dressed, entry, legend, panels
from twin.views.style import INK, level_colour

Rows = Sequence[Mapping[str, Any]]

LEGEND_COLUMNS = 4
"""As many names of sweeps as fit beside each other."""
UNSTABLE = (0, (1, 2))
"""Line style of branches that no sweep can follow."""


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
    """Response per force at every step over the predicted branches; a panel a channel, a colour a sweep."""
    by_sweep: dict[str, list[Mapping[str, Any]]] = {}
    for step in steps:
        if step["frequency_Hz"] and step["phasors"]:
            by_sweep.setdefault(step["sweep"], []).append(step)
    if not by_sweep or not channels:
        return None
    levels = list(dict.fromkeys(rows[0]["target_amplitude"] for rows in by_sweep.values()))
    figure, (axes_of,) = panels(1, len(channels), height_in=3.6)
    for channel, axes in zip(channels, axes_of, strict=True):
        for branch in branches:
            curve = branch["response"].get(channel)
            if curve is not None and branch["force_N"] in levels:
                size = np.array(curve["amplitude"]) / branch["force_N"]
                colour = level_colour(levels.index(branch["force_N"]))
                _plot_branch(axes, np.array(branch["frequency_Hz"]), size, branch.get("stable"), colour)
        for sweep, rows in by_sweep.items():
            x = [row["frequency_Hz"] for row in rows]
            size = [_amplitude(row, channel) / (_amplitude(row, force) if force else 1.0) for row in rows]
            colour = level_colour(levels.index(rows[0]["target_amplitude"]))
            axes.plot(x, size, _marker(sweep), color=colour, markersize=3.6, label=f"{sweep}, each step")
        axes.set_ylim(bottom=0)
        per = f" / |{force}|, SI units" if force else ""
        dressed(axes, title=channel, xlabel="frequency, Hz", ylabel=f"|{channel}|{per}")
    entries = [entry("predicted branch", INK, linewidth=1.2)] if branches else []
    if any(not all(branch.get("stable", [])) for branch in branches):
        entries.append(entry("unstable", INK, linewidth=1.2, linestyle=UNSTABLE))
    legend(figure, entries, columns=LEGEND_COLUMNS)
    return figure


def _plot_branch(
    axes: Axes, frequency_Hz: NDArray[np.float64], size: NDArray[np.float64], stable: Sequence[bool] | None, colour: str
) -> None:
    """Draw a curve, dotted where no rig can stay."""
    stays = np.ones(len(size), bool) if stable is None else np.array(stable)
    # Each part goes on to the next one's first point, so that the curve has no gaps.
    ends = np.append(np.flatnonzero(np.diff(stays)) + 1, len(size))
    begin = 0
    for end in ends:
        part = slice(begin, end + 1)
        style = "-" if stays[begin] else UNSTABLE
        axes.plot(frequency_Hz[part], size[part], color=colour, linewidth=1.2, linestyle=style)
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
    figure, grid = panels(3, 1, height_in=6.4, sharex=True, height_ratios=[3, 3, 2])
    channels = list(noise["density"])
    labels = {
        "density": "spectral density, unit²/Hz", "response": "response per force, SI units", "coherence": "coherence",
    }  # fmt: skip
    for (axes,), (what, label) in zip(grid, labels.items(), strict=True):
        for channel, values in noise[what].items():
            colour = level_colour(channels.index(channel))
            axes.plot(noise["frequency_Hz"], values, color=colour, linewidth=0.9, label=channel)
        axes.set_yscale("linear" if what == "coherence" else "log")
        dressed(axes, ylabel=label)
    grid[2, 0].set(ylim=(0, 1.05), xlabel="frequency, Hz")
    legend(figure, columns=4)
    return figure


def _marker(sweep: str) -> str:
    """Which way a sweep went: both ways lie on each other where all is well."""
    return "^" if sweep.endswith("-up") else "v" if sweep.endswith("-down") else "o"


def _amplitude(step: Mapping[str, Any], channel: str) -> float:
    value = step["phasors"].get(channel, {}).get("amplitude")
    return float(value) if value else np.nan
