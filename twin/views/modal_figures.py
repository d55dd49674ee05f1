"""Pictures of a modal test: responses, stabilisation chart, Nyquist circles, MAC, shapes over the model's."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from twin.arrays import Array
from twin.identify.modes.measured_modes import MeasuredModes
from twin.identify.modes.stabilisation import stable_poles
from twin.structure import drawn_parts, drawn_places
from twin.views.drawing import WIDTH_IN, Drawing, dressed, entry, legend, panels
from twin.views.rig_figure import SENSOR, draw_mode, drawn_larger, extent, flat_parts, scatter
from twin.views.style import AFTER, BEFORE, INK, LEVELS, MEASURED, level_colour

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


def stabilisation_figure(found: MeasuredModes) -> Figure:
    """Measured and fitted responses, and above them the chart; the modes that were taken are marked."""
    figure, ((chart,), (curves,)) = panels(2, 1, height_in=6.0, sharex=True, height_ratios=(3, 2))
    fit, frequency_Hz, few = found.fit, found.frequency_Hz, len(found.outputs) <= len(LEVELS)
    stable = set(stable_poles(fit.chart))
    for kind, colour, size, poles in (
        ("unstable", "#bbbbbb", 6, [pole for pole in fit.chart if pole not in stable]),
        ("stable in frequency and damping", AFTER, 12, sorted(stable, key=lambda pole: pole.order)),
    ):
        chart.scatter(
            [pole.frequency_Hz for pole in poles], [pole.order for pole in poles], s=size, color=colour, label=kind
        )
    for mode in fit.modes:
        chart.axvline(mode.frequency_Hz, color=BEFORE, linewidth=0.8, zorder=0)
    chart.set_ylabel("order of the polynomials")
    chart.legend(loc="lower center", fontsize="small")
    f = np.geomspace(frequency_Hz[0], frequency_Hz[-1], 4000)
    f = np.sort(np.concatenate([f, frequency_Hz]))
    model = np.abs(fit.fit.responses(2 * np.pi * f))
    for o, name in enumerate(found.outputs):
        label = name if few else None
        curves.loglog(frequency_Hz, np.abs(found.H[:, o]), ".", markersize=3, color=level_colour(o), label=label)
        curves.loglog(f, model[:, o], linewidth=0.8, color=INK, zorder=0)
    curves.set(ylabel="response per force", xlabel="frequency (Hz)", xlim=frequency_Hz[[0, -1]])
    if few:
        curves.legend(loc="lower right", fontsize="small")
    return figure


def nyquist_figure(found: MeasuredModes) -> Figure:
    """Each mode where it shows most: measured lines about its resonance, and the fit through them."""
    modes = found.fit.modes
    columns = min(4, max(1, len(modes)))
    rows = max(1, -(-len(modes) // columns))
    figure, axes = panels(rows, columns, height_in=2.4 * rows + 0.5)
    for each in axes.flat[len(modes) :]:
        each.set_visible(False)
    for number, (mode, each) in enumerate(zip(modes, axes.flat[: len(modes)], strict=True), 1):
        about, shown, curve = nyquist(found, number - 1)
        each.plot(curve.real, curve.imag, color=AFTER, linewidth=0.9, label="fit")
        each.plot(about.real, about.imag, ".", color=MEASURED, markersize=4, label="measured")
        dressed(each, title=f"{number}: {mode.frequency_Hz:.5g} Hz, {found.outputs[shown]}")
        each.set_aspect("equal", adjustable="datalim")
        each.xaxis.set_major_locator(MaxNLocator(4))
    legend(figure)
    return figure


def nyquist(found: MeasuredModes, number: int) -> tuple[Array, int, Array]:
    """Measured lines about a mode, of which output, and the fit there on a fine grid."""
    mode = found.fit.modes[number]
    half_Hz = mode.damping_ratio * mode.frequency_Hz + found.rate_per_s / (2 * np.pi)
    near = np.abs(found.frequency_Hz - mode.frequency_Hz) < HALF_WIDTHS * half_Hz
    shown = int(np.argmax(np.abs(mode.residues)))
    fine = mode.frequency_Hz + HALF_WIDTHS * half_Hz * np.linspace(-1, 1, 201) ** 3
    return found.H[near, shown], shown, _fitted(found, fine)[:, shown]


def mac_figure(found: MeasuredModes) -> Figure:
    """Modal assurance criteria of the measured modes with the model's."""
    assert found.beside is not None
    mac, Hz = found.beside.mac, found.beside.modelled.modes.frequency_Hz
    figure = Drawing(figsize=(WIDTH_IN, 0.42 * mac.shape[0] + 1.6), layout="constrained")
    axes = figure.subplots()
    shown = axes.imshow(mac, cmap="Blues", vmin=0, vmax=1, aspect="auto")
    for (r, m), value in np.ndenumerate(mac):
        axes.text(m, r, f"{value:.2f}", ha="center", va="center", fontsize=8, color="white" if value > 0.6 else INK)
    axes.set_xticks(range(mac.shape[1]), [f"{f:.5g}" for f in Hz[: mac.shape[1]]], fontsize=8)
    axes.set_yticks(range(mac.shape[0]), [f"{mode.frequency_Hz:.5g}" for mode in found.fit.modes], fontsize=8)
    axes.set(xlabel="model, Hz", ylabel="measured, Hz")
    figure.colorbar(shown, label="MAC")
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
