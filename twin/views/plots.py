"""What reports and views both plot: sweeps, residuals, broadband responses, the joint's law."""

from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np

from recordings.run import Run
from twin.arrays import Array
from twin.diagnose.answer.comparison import SweepComparison
from twin.identify.measured_data import MeasuredData
from twin.identify.spectra.broadband import BinnedResponse
from twin.views.curves import Fitted, LawBand, SteppedSweep, broadband_responses, law_bands
from twin.views.plot import Axis, Plot, PlotCurve, common_range
from twin.views.receptance import branch_curves, per_force, per_force_label, phase_deg, response_label
from twin.views.style import INK, KIND, MEASURED, NOISE, level_colour

KINDS = {"before": ("dashed", 1.5), "after": ("line", 2.0), "model": ("line", 2.0), "measured": ("point", 3.0)}
"""How each kind of a curve is drawn, and how wide or large."""
ATTRIBUTE = {"model": "after"}
"""Of a sweep's comparison, where it is not called like the kind of curve."""
LEAST = 0.05
"""Residuals below this are drawn at it, in standard deviations."""


def sweep_colours(sweeps: Sequence[SweepComparison]) -> dict[str, str]:
    """A colour for each sweep, by its name."""
    return {sweep.sweep: level_colour(i) for i, sweep in enumerate(sweeps)}


def sweep_plots(
    evidence: MeasuredData, sweeps: Sequence[SweepComparison], colours: Mapping[str, str], kinds: Sequence[str]
) -> tuple[list[Plot], list[Plot], list[Plot]]:
    """Receptance and phase against frequency, and residuals of the fundamental in standard deviations of its noise.

    A plot for each channel, all sweeps in it.  `kinds` are ``before`` and ``after``, or ``model`` where both are one.
    """
    quantity = {output.channel: output.quantity for output in evidence.outputs}
    ends = np.array([end([end(sweep.frequency_Hz) for sweep in sweeps]) for end in (np.min, np.max)])
    told = [(sweep.sweep, colours[sweep.sweep], "") for sweep in sweeps]
    told += [(kind, INK, KINDS[kind][0]) for kind in kinds]
    receptances, phases, residuals = [], [], []
    for o, channel in enumerate(sweeps[0].channels):
        curves, turned, left = [], [], [PlotCurve("noise, one σ", ends, np.ones(2), INK, size=1.0, legend=True)]
        for sweep, kind in product(sweeps, (*kinds, "measured")):
            order, model = np.argsort(sweep.frequency_Hz, kind="stable"), ATTRIBUTE.get(kind, kind)
            name, x, style = f"{sweep.sweep}/{kind}", sweep.frequency_Hz[order], (colours[sweep.sweep], *KINDS[kind])
            response = getattr(sweep, model)[order, o]
            curves.append(PlotCurve(name, x, per_force(response, quantity[channel], x), *style))
            turned.append(PlotCurve(name, x, phase_deg(response, quantity[channel]), *style))
            if kind != "measured":
                residual = np.maximum(getattr(sweep, f"residual_{model}")[order, o], LEAST)
                left.append(PlotCurve(name, x, residual, *style))
        label, measured = per_force_label(channel, quantity[channel]), ("measured", INK, "point")
        receptances.append(Plot.over(channel, "frequency, Hz", label, curves, told=[*told, measured]))
        phases.append(Plot.over(f"{channel}: phase", "frequency, Hz", f"phase at {channel}, °", turned, told=told))
        label = f"residual of {channel}, σ of its noise"
        residuals.append(Plot.over(f"{channel}: residuals", "frequency, Hz", label, left, told=told, log="y"))
    return receptances, phases, residuals


def stepped_plots(
    run: Run, sweeps: Sequence[SteppedSweep], branches: Sequence[Mapping[str, Any]] = ()
) -> dict[str, Plot]:
    """Receptance of a run's sweeps against frequency, by response channel, all levels in each.

    `branches` are a rehearsal's; those that lie elsewhere are left out.
    """
    plots = {}
    low, high = common_range([sweep.frequency_Hz for sweep in sweeps])
    for channel in sweeps[0].receptance:
        drawn = [sweep for sweep in sweeps if channel in sweep.receptance]
        predicted = branch_curves(branches, run.channels[channel])
        near = [curve for curve in predicted if np.any((curve[1] >= low) & (curve[1] <= high))]
        levels = list(dict.fromkeys(sweep.level for sweep in drawn))
        curves, told = [], []
        for sweep in drawn:
            colour, y = level_colour(levels.index(sweep.level)), sweep.receptance[channel]
            curves.append(PlotCurve(f"{sweep.name}/line", sweep.frequency_Hz, y, colour, size=1.0))
            curves.append(PlotCurve(f"{sweep.name}/steps", sweep.frequency_Hz, y, colour, "point", 3.0))
            told.append((sweep.name, colour, "point"))
        for i, (force_N, frequency, size) in enumerate(near):
            level = f"{force_N:g} N"
            colour = level_colour(levels.index(level)) if level in levels else INK
            curves.append(PlotCurve(f"branches/{i}", frequency, size, colour, "dashed", 1.5))
        told += [("predicted branches", INK, "dashed")] if near else []
        label = per_force_label(channel, run.channels[channel].quantity)
        y_axis = Axis.over(label, [np.zeros(1), *(curve.y for curve in curves)])
        x_axis = Axis("frequency, Hz", (low, high))
        plots[channel] = Plot(title=channel, x=x_axis, y=y_axis, curves=curves, told=told)
    return plots


def broadband_plots(evidence: MeasuredData, models: Mapping[str, Fitted], index: int) -> tuple[list[Plot], list[Plot]]:
    """Of broadband run `index`, as :func:`response_plots`."""
    predicted = {kind: broadband_responses(evidence, model, index) for kind, model in models.items()}
    return response_plots(evidence.broadband[index], evidence.units, predicted)


def response_plots(
    data: BinnedResponse, units: Mapping[str, str], predicted: Mapping[str, Array]
) -> tuple[list[Plot], list[Plot]]:
    """Responses per force, measured and predicted, a plot for each channel; and relative errors beside the noise."""
    responses, errors, f = [], [], data.frequency_Hz
    noise = 100 * np.sqrt(np.real(np.diagonal(data.relative_covariance, axis1=1, axis2=2)))
    for o, channel in enumerate(data.channels):
        curves = [PlotCurve("measured", f, np.abs(data.H[:, o]), MEASURED, "point", 1.5, legend=True)]
        gaps = [PlotCurve("noise, one σ", f, noise[:, o], NOISE, size=1.2, legend=True)]
        for kind, H in predicted.items():
            curves.append(PlotCurve(kind, f, np.abs(H[:, o]), KIND[kind], *KINDS[kind], legend=True))
            gaps.append(PlotCurve(kind, f, 100 * np.abs(H[:, o] / data.H[:, o] - 1), KIND[kind], size=1.2, legend=True))
        label = response_label(channel, units[channel])
        responses.append(Plot.over(channel, "frequency, Hz", label, curves, log="y"))
        label = f"relative error of {channel}, %"
        errors.append(Plot.over(f"{channel}, error", "frequency, Hz", label, gaps, log="y"))
    return responses, errors


def law_plots(evidence: MeasuredData, models: Mapping[str, Fitted]) -> dict[str, Plot]:
    """Softening over a layer point's opening and loss over its slip, by those models that have a law.

    By what the function is, such as ``softening``, behind its joint where there are several: ``a-joint/softening``.
    """
    laws = {kind: bands for kind, model in models.items() if (bands := law_bands(evidence, model))}
    plots = {}
    for i, band in enumerate(next(iter(laws.values()), ())):
        name = "/".join(filter(None, (band.joint, band.quantity)))
        plots[name] = law_plot({kind: bands[i] for kind, bands in laws.items()})
    return plots


def law_plot(bands: Mapping[str, LawBand]) -> Plot:
    """One function of the law by every model, with one standard deviation.

    Framed by the last, which is the accepted one: a wrong model may need a law of quite another size.
    """
    accepted = list(bands.values())[-1]
    top, std = 1e-6 * accepted.value, 1e-6 * accepted.std
    up = Axis.over(f"{accepted.quantity} {accepted.function}, N/mm²", [np.zeros(1), top - std, top + std], margin=0.12)
    curves, told = [], []
    for kind, band in bands.items():
        x, y, std = 1e6 * band.amplitude_m, 1e-6 * band.value, 1e-6 * band.std
        if np.any((y > up.ends[0]) & (y < up.ends[1])):
            curves.append(PlotCurve(kind, x, y, KIND[kind], KINDS[kind][0], 2.5, legend=True, std=std))
        else:
            told.append((f"{kind}: {np.median(y):.3g}, off the axis", KIND[kind], ""))
    ends = np.array([1e6 * band.amplitude_m[[0, -1]] for band in bands.values()])
    across = Axis(accepted.label, (float(ends.min()), float(ends.max())), log=True)
    unmeasured = [(1e6 * low, 1e6 * high) for low, high in accepted.unmeasured_m]
    return Plot(title=accepted.title, x=across, y=up, curves=curves, told=told, unmeasured=unmeasured)
