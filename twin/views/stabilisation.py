"""The stabilisation chart: poles over the order of the fit, on top of the responses that they were fitted to."""

import numpy as np
from matplotlib.figure import Figure

from twin.identify.modes.measured_modes import MeasuredModes
from twin.identify.modes.stabilisation import stable_poles
from twin.views.drawing import panels
from twin.views.style import AFTER, BEFORE, INK, LEVELS, level_colour


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
