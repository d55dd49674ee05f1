"""How well a diagnosis's models fit: residuals by channel, harmonic and level, backbones, L-curve, iterations."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.arrays import Array
from twin.diagnose.answer.comparison import SweepComparison, predicted_harmonics
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fitted_model import FittedModel
from twin.identify.l_curve import LCurve, decompose
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.rms import rms
from twin.views.curves import compared_models, each_resonance
from twin.views.plot import Axis, Plot, PlotCurve, common_range
from twin.views.plots import KINDS, LEAST
from twin.views.receptance import per_force, reading_label
from twin.views.reports.answer import residual_rows
from twin.views.rerun.chart import Chart, draw_chart
from twin.views.style import INK, KIND, level_colour

FULL = 1900.0
"""Width of a chart that has half a screen's height and most of its width."""
FAINT = "#3a3f46"


def residual_table(diagnosis: Diagnosis) -> dict[tuple[str, int, str], tuple[float, float]]:
    """Rms residuals in standard deviations of the noise, before and after, by channel, harmonic and sweep."""
    table: dict[tuple[str, int, str], tuple[float, float]] = {}
    for name, channel, before, after in residual_rows(diagnosis.sweeps):
        table[channel, 1, name] = before, after
    search, models = diagnosis.search, list(compared_models(diagnosis).values())
    parts = ((models[0], search.base_harmonics), (models[-1], search.harmonics))
    sizes = [_harmonic_sizes(search.evidence, model, harmonics) for model, harmonics in parts if harmonics is not None]
    if len(sizes) < 2 or search.harmonics is None or sizes[0].shape != sizes[1].shape:
        return table
    rows_of = search.evidence.steps.by_sweep
    for sweep in diagnosis.sweeps:
        rows = rows_of[sweep.sweep]
        for h, order in enumerate(search.harmonics.orders):
            for o, channel in enumerate(sweep.channels):
                table[channel, int(order), sweep.sweep] = rms(sizes[0][rows, h, o]), rms(sizes[1][rows, h, o])
    return table


def _harmonic_sizes(evidence: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals) -> Array:
    """Whitened residuals (s, h, o) of the higher harmonics."""
    left = harmonics.residual - predicted_harmonics(evidence, model, harmonics)
    white = harmonics.whiten(left, harmonics.whitening(model.errors.harmonics))
    real, imaginary = white.reshape(2, *left.shape)
    return np.asarray(np.sqrt((real**2 + imaginary**2) / 2))


def draw_residuals(recording: rr.RecordingStream, diagnosis: Diagnosis) -> rrb.Spatial2DView:
    """One line for each channel and harmonic; on it, for each sweep, from where the residual was to where it is."""
    table = residual_table(diagnosis)
    rows = list(dict.fromkeys((channel, order) for channel, order, _ in sorted(table)))
    sweeps = list(dict.fromkeys(sweep for *_, sweep in table))
    sizes = np.maximum(np.array(list(table.values())).ravel(), LEAST)
    low, high = common_range([sizes, np.ones(1)], log=True)
    chart = Chart(
        recording,
        "/residuals",
        "Residuals by channel, harmonic and level",
        Axis(
            "rms residual, σ of its noise (small dot: before, large dot: after)",
            (low / (high / low) ** 0.16, high),  # room for the names
            log=True,
        ),
        Axis("channel and harmonic", (0.0, float(len(rows))), bare=True),
        width=FULL,
    )
    for i, (channel, order) in enumerate(rows):
        top = len(rows) - i
        chart.draw(PlotCurve(f"rows/{i}", np.array(chart.x.ends), np.full(2, top - 1.0), FAINT, size=0.5))
        chart.label(f"names/{i}", chart.x.ends[0], top - 0.02, f"{channel}, harmonic {order}", INK)
        for k, sweep in enumerate(sweeps):
            if (channel, order, sweep) in table:
                before, after = np.maximum(table[channel, order, sweep], LEAST)
                height = top - (k + 1) / (len(sweeps) + 1)
                at, colour, name = np.array([before, after]), level_colour(k), f"{i}/{k}"
                chart.draw(PlotCurve(f"{name}/way", at, np.full(2, height), colour, size=1.0))
                chart.draw(PlotCurve(f"{name}/before", at[:1], np.full(1, height), colour, "point", 2.0))
                chart.draw(PlotCurve(f"{name}/after", at[1:], np.full(1, height), colour, "point", 5.0))
    for k, sweep in enumerate(sweeps):
        chart.tell(sweep, level_colour(k), "point")
    chart.draw(PlotCurve("noise", np.ones(2), np.array(chart.y.ends), INK, size=1.0))
    chart.tell("the noise", INK, "line")
    return chart.close()


def draw_backbones(recording: rr.RecordingStream, diagnosis: Diagnosis) -> list[rrb.Spatial2DView]:
    """Frequency and size of each sweep's largest step about each resonance, measured and of both models."""
    evidence, views = diagnosis.evidence, []
    output = evidence.outputs[evidence.reference]
    for below, name, about in each_resonance(diagnosis.sweeps):
        if len(about) < 2:
            continue
        curves, told = [], []
        for kind in ("measured", *compared_models(diagnosis)):
            x, y = _tops(about, kind, evidence.reference, output.quantity)
            curves.append(PlotCurve(f"{kind}/line", x, y, KIND[kind], KINDS[kind][0], 1.5))
            curves.append(PlotCurve(f"{kind}/points", x, y, KIND[kind], "point", 5.0 if kind == "measured" else 3.0))
            told.append((kind, KIND[kind], KINDS[kind][0]))
        title = f"Backbone at {output.channel}" + (f", {name}" if name else "")
        label = reading_label(output.channel, output.quantity)
        plot = Plot.over(title, "frequency of each sweep's largest step, Hz", label, curves, told=told, margin=0.1)
        views.append(draw_chart(recording, f"/backbone{below or '/1'}", plot, width=FULL))
    return views


def _tops(sweeps: Sequence[SweepComparison], kind: str, output: int, quantity: str) -> tuple[Array, Array]:
    """Frequency, Hz, and displacement, mm (or strain, µm/m), of the largest step of each sweep, by rising force."""
    tops = []
    for sweep in sorted(sweeps, key=lambda each: float(np.median(each.force_N))):
        size = per_force(getattr(sweep, kind)[:, output], quantity, sweep.frequency_Hz) * sweep.force_N
        at = int(np.argmax(size))
        tops.append((sweep.frequency_Hz[at], size[at]))
    frequency, displacement = np.array(tops).T
    return frequency, displacement


def l_curve_of(evidence: MeasuredData, fitted_model: FittedModel) -> LCurve:
    """The L-curve of the last Gauss-Newton step for the joint's law and the base parameters, causes held.

    Both norms are as the fit weighs them: the residual in its noise, the solution as departure from the prior, which
    for the law is its bending.  The fit itself stands at strength 1.
    """
    mean, precision = ResidualModel(evidence).prior(fitted_model.baseline)
    count = len(mean)
    # R with R' R the prior's precision turns its penalty into a plain sum of squares.
    R = np.linalg.cholesky(precision).T
    J, x = fitted_model.solution.jacobian[:, :count], fitted_model.solution.x[:count]
    return decompose(J @ np.linalg.inv(R), J @ (x - mean) - fitted_model.solution.residual).l_curve()


def draw_l_curve(recording: rr.RecordingStream, diagnosis: Diagnosis) -> rrb.Spatial2DView | None:
    """The last fits' residual against their departure from the prior; nothing where no data speak."""
    curves = {}
    for kind, fitted_model in compared_models(diagnosis).items():
        try:
            curve = l_curve_of(diagnosis.search.evidence, fitted_model)
        except np.linalg.LinAlgError:  # a prior that is flat in some direction has no norm to measure by
            continue
        if len(curve.strength) > 1:
            curves[kind] = curve
    if not curves:
        return None
    drawn = []
    for kind, curve in curves.items():
        style, x, y = KINDS[kind][0], curve.residual_norm, curve.solution_norm
        drawn.append(PlotCurve(kind, x, y, KIND[kind], style, legend=True))
        for name, strength, size in (("corner", curve.corner, 3.0), ("fit", 1.0, 6.0)):
            if curve.strength[0] <= strength <= curve.strength[-1]:
                at = [int(np.argmin(np.abs(np.log(curve.strength / strength))))]
                drawn.append(PlotCurve(f"{kind}/{name}", x[at], y[at], KIND[kind], "point", size))
    told = [("large: the fit, small: the corner", INK, "point")]
    plot = Plot.over(
        "L-curves of the last fits", "residual: root of chi²", "departure from the prior, in its σ", drawn, told=told,
        log="xy",
    )  # fmt: skip
    return draw_chart(recording, "/l_curve", plot, width=FULL)


def draw_history(recording: rr.RecordingStream, diagnosis: Diagnosis) -> rrb.Spatial2DView:
    """Cost after each Gauss-Newton iteration of the last fit of each model."""
    curves = []
    for kind, fitted_model in compared_models(diagnosis).items():
        history = np.array(fitted_model.solution.history)
        steps, style = np.arange(len(history)), KINDS[kind][0]
        curves.append(PlotCurve(kind, steps, history, KIND[kind], style, legend=True))
        curves.append(PlotCurve(f"{kind}/points", steps, history, KIND[kind], "point", 3.0))
    plot = Plot.over(
        "Last fits, iteration by iteration", "iteration", "cost: chi² with the prior's part", curves, log="y"
    )
    return draw_chart(recording, "/history", plot, width=FULL)
