"""Pictures of a modal test: responses, stabilisation chart, Nyquist circles, MAC, shapes over the model's."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from twin.arrays import Array
from twin.identify.modes.measured_modes import MeasuredModes
from twin.identify.modes.stabilisation import stable_poles
from twin.structure import drawn_parts, drawn_places
from twin.views.drawing import WIDTH_IN, Drawing, dressed, entry, heat_map, legend, panels
from twin.views.figures import draw_plot, plots_figure
from twin.views.plot import Plot, PlotCurve
from twin.views.rig_figure import SENSOR, draw_mode, drawn_larger, extent, flat_parts, scatter
from twin.views.style import AFTER, BEFORE, INK, LEVELS, MEASURED, NOISE, level_colour

HALF_WIDTHS = 8.0
"""How far a Nyquist circle goes about its resonance."""


def responses_figure(found: MeasuredModes) -> Figure:
    """All responses, the phase of the largest one, and the coherence of all."""
    rows = 2 if found.coherence is None else 3
    figure, axes = panels(rows, 1, height_in=2.2 * rows + 0.5, sharex=True)
    f, shown = found.frequency_Hz, _largest(found)
    for row in np.abs(found.H).T:
        axes[0, 0].semilogy(f, row, color="#bbbbbb", linewidth=0.6)
    axes[0, 0].semilogy(f, np.abs(found.H[:, shown]), ".", color=MEASURED, markersize=2.5, label=found.outputs[shown])
    axes[0, 0].semilogy(f, np.abs(_fitted(found, f)[:, shown]), color=AFTER, linewidth=0.9, label="fit")
    dressed(axes[0, 0], ylabel="|response / force|, SI units")
    axes[1, 0].plot(f, np.degrees(np.angle(found.H[:, shown])), ".", color=MEASURED, markersize=2.5)
    axes[1, 0].set_yticks(range(-180, 181, 90))
    dressed(axes[1, 0], ylabel="phase, degrees")
    if found.coherence is not None:
        axes[2, 0].plot(f, found.coherence.min(axis=1), color="#bbbbbb", linewidth=0.8)
        axes[2, 0].plot(f, found.coherence[:, shown], color=MEASURED, linewidth=0.8)
        axes[2, 0].set_ylim(0, 1.02)
        dressed(axes[2, 0], ylabel="coherence")
    for each in axes[:, 0]:
        for mode in found.fit.modes:
            each.axvline(mode.frequency_Hz, color=BEFORE, linewidth=0.6, zorder=0)
    axes[-1, 0].set_xlabel("frequency, Hz")
    legend(
        figure,
        [entry("all others; of coherence the worst", "#bbbbbb", linewidth=1.0), entry("modes", BEFORE, linewidth=1.0)],
    )
    return figure


def stabilisation_plot(found: MeasuredModes) -> Plot:
    """Poles of fits of rising order, those that stay apart from those that do not, and the modes that were taken."""
    chart, stable = found.fit.chart, set(stable_poles(found.fit.chart))
    curves = []
    for name, colour, size, poles in (
        ("unstable", NOISE, 2.0, [pole for pole in chart if pole not in stable]),
        ("stable in frequency and damping", AFTER, 3.0, [pole for pole in chart if pole in stable]),
    ):
        f, order = (np.array([getattr(pole, key) for pole in poles]) for key in ("frequency_Hz", "order"))
        curves.append(PlotCurve(name, f, order, colour, "point", size, legend=True))
    top = np.array([0.0, max((pole.order for pole in chart), default=1)])
    curves += [
        PlotCurve(f"mode {number}", np.full(2, mode.frequency_Hz), top, BEFORE, size=1.0)
        for number, mode in enumerate(found.fit.modes, 1)
    ]
    told = [("modes", BEFORE, "line")]
    return Plot.over("Stabilisation", "frequency, Hz", "order of the polynomials", curves, told=told)


def stabilisation_figure(found: MeasuredModes) -> Figure:
    """The stabilisation chart above the measured and fitted responses."""
    figure, ((chart,), (curves,)) = panels(2, 1, height_in=6.0, sharex=True, height_ratios=(3, 2))
    plot, frequency_Hz, few = stabilisation_plot(found), found.frequency_Hz, len(found.outputs) <= len(LEVELS)
    draw_plot(chart, replace(plot, x=replace(plot.x, label="")))
    chart.legend(loc="lower center", fontsize="small")
    f = np.geomspace(frequency_Hz[0], frequency_Hz[-1], 4000)
    f = np.sort(np.concatenate([f, frequency_Hz]))
    model = np.abs(_fitted(found, f))
    for o, name in enumerate(found.outputs):
        label = name if few else None
        curves.loglog(frequency_Hz, np.abs(found.H[:, o]), ".", markersize=3, color=level_colour(o), label=label)
        curves.loglog(f, model[:, o], linewidth=0.8, color=INK, zorder=0)
    curves.set(ylabel="response per force", xlabel="frequency (Hz)", xlim=frequency_Hz[[0, -1]])
    if few:
        curves.legend(loc="lower right", fontsize="small")
    return figure


def nyquist_plots(found: MeasuredModes) -> list[Plot]:
    """Each mode where it shows most: measured lines about its resonance, and the fit through them on a fine grid."""
    plots = []
    for number, mode in enumerate(found.fit.modes, 1):
        half_Hz = mode.damping_ratio * mode.frequency_Hz + found.rate_per_s / (2 * np.pi)
        near = np.abs(found.frequency_Hz - mode.frequency_Hz) < HALF_WIDTHS * half_Hz
        shown = int(np.argmax(np.abs(mode.residues)))
        fine = mode.frequency_Hz + HALF_WIDTHS * half_Hz * np.linspace(-1, 1, 201) ** 3
        about, fit = found.H[near, shown], _fitted(found, fine)[:, shown]
        curves = [
            PlotCurve("fit", fit.real, fit.imag, AFTER, legend=True),
            PlotCurve("measured", about.real, about.imag, MEASURED, "point", 3.0, legend=True),
        ]
        title = f"{number}: {mode.frequency_Hz:.5g} Hz, {found.outputs[shown]}"
        plots.append(Plot.over(title, "real part", "imaginary part", curves))
    return plots


def nyquist_figure(found: MeasuredModes) -> Figure:
    """Circles of all modes, up to four in a row."""
    figure = plots_figure(nyquist_plots(found), columns=4, height_in=2.4)
    for axes in figure.axes:
        axes.autoscale()  # limits of its own would be ignored, and matplotlib would tell so
        axes.set_aspect("equal", adjustable="datalim")
        axes.xaxis.set_major_locator(MaxNLocator(4))
    return figure


def mac_figure(found: MeasuredModes) -> Figure:
    """Modal assurance criteria of the measured modes with the model's."""
    assert found.beside is not None
    mac, Hz = found.beside.mac, found.beside.modelled.modes.frequency_Hz
    figure = Drawing(figsize=(WIDTH_IN, 0.42 * mac.shape[0] + 1.6), layout="constrained")
    axes = figure.subplots()
    measured, modelled = [mode.frequency_Hz for mode in found.fit.modes], Hz[: mac.shape[1]]
    rows, columns = ([f"{f:.5g}" for f in each] for each in (measured, modelled))
    heat_map(axes, mac, np.vectorize("{:.2f}".format)(mac), rows=rows, columns=columns)
    axes.set(xlabel="model, Hz", ylabel="measured, Hz")
    figure.colorbar(axes.images[0], label="MAC")
    return figure


def shapes_figure(found: MeasuredModes) -> Figure:
    """The model's modes in space, and the measured shapes at their places."""
    assert found.beside is not None
    beside = found.beside
    parts = drawn_parts(beside.modelled.structure)
    plane, size = flat_parts(parts), extent(parts)
    rows = -(-len(beside.pairs) // 2)
    figure = Drawing(figsize=(WIDTH_IN, (2.4 if plane else 3.4) * rows + 0.4), layout="constrained")
    at = drawn_places(beside.modelled.structure, beside.places, name="measured").points
    for cell, (number, mode) in enumerate(sorted(beside.pairs.items()), 1):
        axes = figure.add_subplot(rows, 2, cell, **({} if plane else {"projection": "3d"}))
        draw_mode(axes, beside.modelled, mode, parts, None, flat=plane)
        larger = drawn_larger([part.rows @ beside.modelled.modes.Phi[:, mode] for part in parts], size)
        moved = at + larger * measured_motion(found, number).real.T
        scatter(axes, moved, SENSOR, "o", 22, flat=plane, label="measured")
        mac = f", MAC {beside.mac[number, mode]:.4f}" if len(at) > 1 else ""
        axes.set_title(f"measured {found.fit.modes[number].frequency_Hz:.5g} Hz{mac}", fontsize=10)
    legend(figure)
    return figure


def measured_motion(found: MeasuredModes, number: int) -> Array:
    """A measured mode's complex displacements (3, d) at its places, as large as the model's; across, these alone."""
    assert found.beside is not None
    beside, mode = found.beside, found.beside.pairs[number]
    directions = np.array([place.direction for place in beside.places]).T
    places = drawn_places(beside.modelled.structure, beside.places, name="measured")
    off = beside.scaled(found.shapes[number].values, mode) - beside.shapes[:, mode]
    return np.asarray(places.rows @ beside.modelled.modes.Phi[:, mode] + directions * off)


def _largest(found: MeasuredModes) -> int:
    """The output that shows most of all modes, each taken by its largest."""
    shown: Sequence[Array] = [np.abs(mode.residues) / np.max(np.abs(mode.residues)) for mode in found.fit.modes]
    return int(np.argmax(np.min(shown, axis=0)))


def _fitted(found: MeasuredModes, frequency_Hz: Array) -> Array:
    return found.fit.fit.responses(2 * np.pi * frequency_Hz)
