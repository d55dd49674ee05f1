"""Noise in the report of a rehearsal: densities, responses, coherence, modes, and whether it lasted long enough."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twin.views.drawing import dressed, legend, panels
from twin.views.page import Picture, Section
from twin.views.style import level_colour
from twin.views.table import Table


def noise_sentence(noise: Mapping[str, Any]) -> str:
    """What a stretch of noise shows, and whether it was long enough."""
    modes = ", ".join(f"{mode['frequency_Hz']:.4g}" for mode in noise["modes"])
    told = f"{noise['sweep']}: modes found at {modes} Hz" if modes else f"{noise['sweep']}: no mode found"
    coherence = [value for values in noise["coherence"].values() for value in values]
    told += f"; median coherence {np.median(coherence):.3g}" if coherence else ""
    lowest = noise["lowest_mode"]
    if lowest is None:
        return told
    return (
        f"{told}; {noise['duration_s']:.4g} s make {lowest['averages']:.2g} averages at the width of the lowest mode, "
        f"{lowest['width_Hz']:.2g} Hz at {lowest['frequency_Hz']:.4g} Hz"
    )


def noise_section(noise: Mapping[str, Any]) -> Section:
    """A stretch of noise at a glance."""
    rows = [
        (
            str(number), f"{mode['frequency_Hz']:.6g}", f"{mode['frequency_std_Hz']:.1g}",
            f"{100 * mode['damping_ratio']:.4g}", f"{100 * mode['damping_std']:.1g}",
        )
        for number, mode in enumerate(noise["modes"], 1)
    ]  # fmt: skip
    head = ("mode", "frequency, Hz", "std", "damping ratio, %", "std")
    told = noise_sentence(noise)
    return Section(
        title="Noise",
        texts=[f"{told}."],
        tables=[Table(caption="Modes that it shows", head=head, rows=rows, numbers=range(5))] if rows else [],
        pictures=[
            Picture(
                draw=lambda: noise_figure(noise),
                alt=f"Spectral densities of all channels, responses per force and coherence over frequency. {told}.",
                caption=f"Densities, responses per force and coherence at a resolution of {noise['resolution_Hz']:.2g} "
                "Hz, averaged over stretches, each of which begins in the middle of the one before.",
            )
        ],
    )


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
