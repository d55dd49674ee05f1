"""The stabilisation chart: poles over the order of the fit, on top of the responses that they were fitted to."""

import numpy as np
from matplotlib.figure import Figure

from twin.identify.broadband import BinnedResponse
from twin.identify.modes import ModalFit
from twin.identify.modes.stabilisation import stable_poles
from twin.views.drawing import panels
from twin.views.style import AFTER, BEFORE, INK, level_colour


def stabilisation_figure(fit: ModalFit, response: BinnedResponse) -> Figure:
    """Measured and fitted responses, and above them the chart; the modes that were taken are marked."""
    figure, ((chart,), (curves,)) = panels(2, 1, height_in=6.0, sharex=True, height_ratios=(3, 2))
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
    f = np.geomspace(response.frequency_Hz[0], response.frequency_Hz[-1], 4000)
    f = np.sort(np.concatenate([f, response.frequency_Hz]))
    model = np.abs(fit.fit.responses(2 * np.pi * f))
    for o, channel in enumerate(response.channels):
        curves.loglog(
            response.frequency_Hz, np.abs(response.H[:, o]), ".", markersize=3, color=level_colour(o), label=channel
        )
        curves.loglog(f, model[:, o], linewidth=0.8, color=INK, zorder=0)
    curves.set(ylabel="response per force", xlabel="frequency (Hz)", xlim=response.frequency_Hz[[0, -1]])
    curves.legend(loc="lower right", fontsize="small")
    return figure
