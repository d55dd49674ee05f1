"""Coupled responses: predicted with the file's joints and with the identified ones, over what was measured."""

import numpy as np
from matplotlib.figure import Figure

from twin.substructuring import CoupledPrediction, JointFit, Substructures
from twin.views.drawing import draw_band, dressed, legend, panels
from twin.views.style import AFTER, BEFORE, MEASURED


def coupled_figure(parts: Substructures, predicted: CoupledPrediction, fit: JointFit | None = None) -> Figure:
    """Magnitudes of each sensor's response over the first drive's force, with one standard deviation."""
    sensors = [sensor.channel for sensor in parts.rig.response_sensors]
    figure, axes = panels(len(sensors), 1, height_in=0.5 + 2.2 * len(sensors), sharex=True)
    for number, (name, each) in enumerate(zip(sensors, axes[:, 0], strict=True)):
        if fit is not None:
            f = fit.before.frequency_Hz
            each.plot(f, np.abs(fit.measured[:, number, 0]), ".", color=MEASURED, markersize=2.5, label="measured")
            each.plot(f, np.abs(fit.before.H[:, number, 0]), color=BEFORE, linewidth=0.8, label="joints of the file")
        label = "predicted" if fit is None else "joints identified"
        magnitude, std = np.abs(predicted.H[:, number, 0]), predicted.std[:, number, 0]
        draw_band(each, predicted.frequency_Hz, magnitude, std, colour=AFTER, linewidth=0.9, label=label)
        each.set_yscale("log")
        dressed(each, ylabel=f"|{name} / force|, SI units")
    axes[-1, 0].set_xlabel("frequency, Hz")
    legend(figure)
    return figure
