"""Pictures of models beside measurements, drawn without a screen; the caller saves or shows them."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.measured_data import MeasuredData
from twin.views.curves import Fitted, LawBand, about_each_resonance, broadband_responses, laws_by_kind
from twin.views.drawing import draw_band, dressed, entry, legend, log_ticks, panels
from twin.views.receptance import per_force, per_force_label, response_label
from twin.views.style import INK, KIND, MEASURED, NOISE, level_colour

ATTRIBUTE = {"model": "after"}
"""Of a sweep's comparison, where it is not called like the kind of curve."""
STYLES: dict[str, dict[str, Any]] = {
    "measured": {"linestyle": "none", "marker": "o", "markersize": 3.2},
    "before": {"linestyle": (0, (4, 2.5)), "linewidth": 1.2},
    "after": {"linestyle": "-", "linewidth": 1.6},
    "model": {"linestyle": "-", "linewidth": 1.6},
}
SHADE = "#e6e6e6"
"""Of amplitudes that were not measured."""


def sweeps_figure(
    evidence: MeasuredData, sweeps: Sequence[SweepComparison], *, kinds: Sequence[str] = ("measured", "before", "after")
) -> Figure:
    """Receptance against frequency: a row for each resonance, in it a panel for each channel, a colour for each sweep.

    `kinds` are of ``measured``, ``before`` and ``after``, or ``model`` where both models are one.
    """
    quantity = {output.channel: output.quantity for output in evidence.outputs}
    channels, groups = sweeps[0].channels, about_each_resonance(sweeps)
    figure, grid = panels(len(groups), len(channels), height_in=0.6 + 3.0 * len(groups))
    for (g, group), (o, channel) in product(enumerate(groups), enumerate(channels)):
        axes = grid[g][o]
        for i in group:
            sweep = sweeps[i]
            order = np.argsort(sweep.frequency_Hz, kind="stable")
            for kind in kinds:
                H = getattr(sweep, ATTRIBUTE.get(kind, kind))[:, o]
                size = per_force(H, quantity[channel], sweep.frequency_Hz)
                axes.plot(sweep.frequency_Hz[order], size[order], color=level_colour(i), **STYLES[kind])
        axes.set_ylim(bottom=0)
        dressed(axes, title=channel, xlabel="frequency, Hz", ylabel=per_force_label(channel, quantity[channel]))
    entries = [entry(sweep.sweep, level_colour(i), linewidth=4) for i, sweep in enumerate(sweeps)]
    legend(figure, [*entries, *(entry(kind, INK, **STYLES[kind]) for kind in kinds)])
    return figure


def residuals_figure(sweeps: Sequence[SweepComparison], *, kinds: Sequence[str] = ("before", "after")) -> Figure:
    """Residuals in standard deviations of their noise: a row a channel, a column for each of the worst sweeps."""
    worst = sorted(sweeps, key=lambda sweep: -float(np.max(sweep.residual_before)))[:4]
    shown = [sweep for sweep in sweeps if sweep in worst]
    channels = sweeps[0].channels
    height_in = 0.6 + 2.1 * len(channels)
    figure, grid = panels(len(channels), len(shown), height_in=height_in, sharex="col", sharey=True)
    for (o, channel), (s, sweep) in product(enumerate(channels), enumerate(shown)):
        axes, order = grid[o][s], np.argsort(sweep.frequency_Hz, kind="stable")
        for kind in kinds:
            size = np.maximum(getattr(sweep, f"residual_{ATTRIBUTE.get(kind, kind)}")[order, o], 0.05)
            axes.semilogy(sweep.frequency_Hz[order], size, color=KIND[kind], label=kind, **STYLES[kind])
        axes.axhline(1.0, color=NOISE, linewidth=0.9, label="one standard deviation of the noise")
        dressed(
            axes, title="" if o else sweep.sweep, xlabel="frequency, Hz" if o == len(channels) - 1 else "",
            ylabel="" if s else f"{channel}: residual, σ",
        )  # fmt: skip
    legend(figure)
    return figure


def law_figure(evidence: MeasuredData, models: Mapping[str, Fitted]) -> Figure:
    """Softening over a layer point's opening and loss over its slip, with one standard deviation; any has a law."""
    laws = laws_by_kind(evidence, models)
    count = len(next(iter(laws.values()))) // 2
    figure, grid = panels(count, 2, height_in=3.3 * count)
    for i, axes in enumerate(grid.ravel()):
        for kind, bands in laws.items():
            draw_law(axes, bands[i], colour=KIND[kind], label=kind, **STYLES[kind])
        # The last is the accepted one: a wrong model may need a law of quite another size.
        frame_law(axes, bands[i])
    legend(figure, [unmeasured_entry()])
    return figure


def draw_law(axes: Axes, band: LawBand, *, colour: str, **style: Any) -> None:
    """One function of the joint's law with one standard deviation, N/mm2 over micrometres."""
    draw_band(axes, 1e6 * band.amplitude_m, 1e-6 * band.value, 1e-6 * band.std, colour=colour, **style)


def frame_law(axes: Axes, band: LawBand) -> None:
    """Axes that hold this function, and shade where no step reached."""
    low = 1e-6 * min(0.0, float(np.min(band.value - band.std)))
    high = 1e-6 * max(0.0, float(np.max(band.value + band.std)))
    log_ticks(axes)
    axes.set_xlim(1e6 * band.amplitude_m[0], 1e6 * band.amplitude_m[-1])
    axes.set_ylim(low - 0.08 * (high - low), high + 0.08 * (high - low))
    for first, last in band.unmeasured_m:
        axes.axvspan(1e6 * first, 1e6 * last, color=SHADE, linewidth=0, zorder=0.4)
    dressed(axes, title=band.title, xlabel=band.label, ylabel=f"{band.function}, N/mm²")


def unmeasured_entry() -> Patch:
    """What the shade of :func:`frame_law` means, for a legend."""
    return Patch(facecolor=SHADE, label="no step reached this")


def broadband_figure(evidence: MeasuredData, models: Mapping[str, Fitted], index: int = 0) -> Figure:
    """Broadband run `index`: responses measured and predicted, and below them the relative errors beside the noise."""
    data = evidence.broadband[index]
    predicted = {kind: broadband_responses(evidence, model, index) for kind, model in models.items()}
    count = len(data.channels)
    figure, grid = panels(2, count, height_in=4.8, sharex=True, sharey="row", height_ratios=[3, 2])
    for o, channel in enumerate(data.channels):
        upper, lower = grid[:, o]
        draw_measured(upper, data.frequency_Hz, np.abs(data.H[:, o]))
        for kind, H in predicted.items():
            upper.semilogy(data.frequency_Hz, np.abs(H[:, o]), color=KIND[kind], label=kind, **STYLES[kind])
            error = 100 * np.abs(H[:, o] / data.H[:, o] - 1)
            lower.semilogy(data.frequency_Hz, error, color=KIND[kind], linewidth=0.9)
        noise = 100 * np.sqrt(np.real(data.relative_covariance[:, o, o]))
        lower.semilogy(data.frequency_Hz, noise, color=NOISE, linewidth=0.9, label="noise, one σ")
        dressed(upper, title=channel, ylabel=response_label(channel, evidence.units[channel]))
        dressed(lower, xlabel="frequency, Hz", ylabel="relative error, %")
    legend(figure)
    return figure


def draw_measured(axes: Axes, frequency_Hz: Any, size: Any) -> None:
    """Measured responses in bins, as dots on a logarithmic axis."""
    axes.semilogy(frequency_Hz, size, color=MEASURED, label="measured", linestyle="none", marker="o", markersize=2.0)


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
