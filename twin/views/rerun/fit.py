"""How well a diagnosis's models fit: residuals by channel, harmonic and level, backbones, L-curve, iterations."""

from collections.abc import Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from twin.diagnose.comparison import SweepComparison, predicted_harmonics
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.result import Diagnosis
from twin.identify.l_curve import LCurve, decompose
from twin.identify.measured_data import MeasuredData
from twin.identify.residual_model import ResidualModel
from twin.identify.sweeps import rows_by_sweep
from twin.identify.whitening import HarmonicResiduals
from twin.views.curves import about_each_resonance, compared_models, resonance_names
from twin.views.receptance import per_force, reading_label
from twin.views.rerun.chart import Axis, Chart, common_range
from twin.views.style import INK, KIND, level_colour

Array = NDArray[Any]

FULL = 1900.0
"""Width of a chart that has half a screen's height and most of its width."""
FAINT = "#3a3f46"
LEAST = 0.01
"""Residuals below this are drawn at it, in standard deviations."""


def residual_table(diagnosis: Diagnosis) -> dict[tuple[str, int, str], tuple[float, float]]:
    """Rms residuals in standard deviations of the noise, before and after, by channel, harmonic and sweep."""
    table: dict[tuple[str, int, str], tuple[float, float]] = {}
    for sweep in diagnosis.sweeps:
        for o, channel in enumerate(sweep.channels):
            table[channel, 1, sweep.sweep] = _rms(sweep.residual_before[:, o]), _rms(sweep.residual_after[:, o])
    search, models = diagnosis.search, list(compared_models(diagnosis).values())
    parts = ((models[0], search.base_harmonics), (models[-1], search.harmonics))
    sizes = [_harmonic_sizes(search.evidence, model, harmonics) for model, harmonics in parts if harmonics is not None]
    if len(sizes) < 2 or search.harmonics is None or sizes[0].shape != sizes[1].shape:
        return table
    rows_of = rows_by_sweep(search.evidence.steps.states)
    for sweep in diagnosis.sweeps:
        rows = rows_of[sweep.sweep]
        for h, order in enumerate(search.harmonics.orders):
            for o, channel in enumerate(sweep.channels):
                table[channel, int(order), sweep.sweep] = _rms(sizes[0][rows, h, o]), _rms(sizes[1][rows, h, o])
    return table


def _harmonic_sizes(evidence: MeasuredData, model: FittedModel, harmonics: HarmonicResiduals) -> Array:
    """Whitened residuals (s, h, o) of the higher harmonics."""
    left = harmonics.residual - predicted_harmonics(evidence, model, harmonics)
    real, imaginary = harmonics.whiten(left).reshape(2, *left.shape)
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
        chart.line(f"rows/{i}", np.array(chart.x.ends), np.full(2, top - 1.0), FAINT, width=0.5, legend=False)
        chart.label(f"names/{i}", chart.x.ends[0], top - 0.02, f"{channel}, harmonic {order}", INK)
        for k, sweep in enumerate(sweeps):
            if (channel, order, sweep) in table:
                before, after = np.maximum(table[channel, order, sweep], LEAST)
                height = top - (k + 1) / (len(sweeps) + 1)
                at, colour, name = np.array([before, after]), level_colour(k), f"{i}/{k}"
                chart.line(f"{name}/way", at, np.full(2, height), colour, width=1.0, legend=False)
                chart.points(f"{name}/before", at[:1], np.full(1, height), colour, size=2.0, legend=False)
                chart.points(f"{name}/after", at[1:], np.full(1, height), colour, size=5.0, legend=False)
    for k, sweep in enumerate(sweeps):
        chart.tell(sweep, level_colour(k), "point")
    chart.line("noise", np.ones(2), np.array(chart.y.ends), INK, width=1, legend=False)
    chart.tell("the noise", INK, "line")
    return chart.close()


def draw_backbones(recording: rr.RecordingStream, diagnosis: Diagnosis) -> list[rrb.Spatial2DView]:
    """Frequency and size of each sweep's largest step about each resonance, measured and of both models."""
    sweeps = diagnosis.sweeps
    groups = about_each_resonance(sweeps) if sweeps else []
    chosen = [[sweeps[place] for place in group] for group in groups]
    return [
        _backbone(recording, diagnosis, about, f"/backbone/{number}", f", {name}" if name else "")
        for number, (about, name) in enumerate(zip(chosen, resonance_names(sweeps, groups), strict=True), 1)
        if len(about) > 1
    ]


def _backbone(
    recording: rr.RecordingStream, diagnosis: Diagnosis, sweeps: Sequence[SweepComparison], path: str, where: str
) -> rrb.Spatial2DView:
    evidence = diagnosis.evidence
    output = evidence.outputs[evidence.reference]
    kinds = ("measured", *compared_models(diagnosis))
    lines = {kind: _tops(sweeps, kind, evidence.reference, output.quantity) for kind in kinds}
    chart = Chart(
        recording,
        path,
        f"Backbone at {output.channel}{where}",
        Axis.over("frequency of each sweep's largest step, Hz", [x for x, _ in lines.values()], margin=0.15),
        Axis.over(reading_label(output.channel, output.quantity), [np.zeros(1), *(y for _, y in lines.values())]),
        width=FULL,
    )
    for kind, (x, y) in lines.items():
        dashed = kind == "before"
        chart.line(f"{kind}/line", x, y, KIND[kind], width=1.5, dashed=dashed, legend=False)
        chart.points(f"{kind}/points", x, y, KIND[kind], size=5.0 if kind == "measured" else 3.0, legend=False)
        chart.tell(kind, KIND[kind], {"measured": "point", "before": "dashed"}.get(kind, "line"))
    return chart.close()


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
    chart = Chart(
        recording,
        "/l_curve",
        "L-curves of the last fits",
        Axis.over("residual: root of chi²", [curve.residual_norm for curve in curves.values()], log=True),
        Axis.over("departure from the prior, in its σ", [curve.solution_norm for curve in curves.values()], log=True),
        width=FULL,
    )
    for kind, curve in curves.items():
        chart.line(kind, curve.residual_norm, curve.solution_norm, KIND[kind], dashed=kind == "before")
        for name, strength, size in (("corner", curve.corner, 3.0), ("fit", 1.0, 6.0)):
            if curve.strength[0] <= strength <= curve.strength[-1]:
                at = int(np.argmin(np.abs(np.log(curve.strength / strength))))
                place = curve.residual_norm[at : at + 1], curve.solution_norm[at : at + 1]
                chart.points(f"{kind}/{name}", *place, KIND[kind], size=size, legend=False)
    chart.tell("large: the fit, small: the corner", INK, "point")
    return chart.close()


def draw_history(recording: rr.RecordingStream, diagnosis: Diagnosis) -> rrb.Spatial2DView:
    """Cost after each Gauss-Newton iteration of the last fit of each model."""
    fits = {kind: np.array(fitted_model.solution.history) for kind, fitted_model in compared_models(diagnosis).items()}
    longest = max(len(history) for history in fits.values())
    chart = Chart(
        recording,
        "/history",
        "Last fits, iteration by iteration",
        Axis("iteration", (-0.5, max(longest - 0.5, 1.5))),
        Axis.over("cost: chi² with the prior's part", list(fits.values()), log=True),
        width=FULL,
    )
    for kind, history in fits.items():
        steps = np.arange(len(history))
        chart.line(kind, steps, history, KIND[kind], dashed=kind == "before")
        chart.points(f"{kind}/points", steps, history, KIND[kind], legend=False)
    return chart.close()


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(np.square(values)))) if len(values) else float("nan")
