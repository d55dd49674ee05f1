"""Noise in the report of a rehearsal: densities, responses, coherence, modes, and whether it lasted long enough."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from twin.views.drawing import Drawing
from twin.views.figures import WIDTH_IN, dressed
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
    figure = Drawing(figsize=(WIDTH_IN, 6.4), layout="constrained")
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[3, 3, 2])
    channels = list(noise["density"])
    for axes, what, label in zip(
        panels, ("density", "response", "coherence"),
        ("spectral density, unit²/Hz", "response per force, SI units", "coherence"), strict=True,
    ):  # fmt: skip
        for channel, values in noise[what].items():
            draw = axes.plot if what == "coherence" else axes.semilogy
            draw(
                noise["frequency_Hz"], values, color=level_colour(channels.index(channel)), linewidth=0.9, label=channel
            )
        axes.set_ylabel(label)
        dressed(axes)
    panels[2].set(ylim=(0, 1.05), xlabel="frequency, Hz")
    panels[0].legend(frameon=False, fontsize=9, ncols=4, loc="lower center", bbox_to_anchor=(0.5, 1.02))
    return figure
