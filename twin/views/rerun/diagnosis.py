"""A diagnosis in rerun: the answer, measured against both models, residuals, the joint's law and loops, the motion."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fitted_model import modification_of
from twin.identify.measured_data import MeasuredData
from twin.views.curves import LawBand, broadband_responses, compared_models, each_resonance, laws_by_kind
from twin.views.operating import modal_motion, operating_motions
from twin.views.receptance import per_force, per_force_label, response_label
from twin.views.reports.diagnosis import diagnosis_page
from twin.views.reports.where import regions_of
from twin.views.rerun.chart import Axis, Chart, ChartCurve, draw_chart
from twin.views.rerun.fit import draw_backbones, draw_history, draw_l_curve, draw_residuals
from twin.views.rerun.motion import SLOW_MOTION, animate_joint, animate_rig, draw_loops
from twin.views.rerun.rrd import recording_file, send_layout
from twin.views.style import INK, KIND, MEASURED, NOISE, level_colour

KINDS = (("before", "dashed", 1.5), ("after", "line", 2.0), ("measured", "point", 3.0))
"""Of a sweep's curves: how each is drawn, and how wide or large."""


def save_diagnosis(diagnosis: Diagnosis, path: Path) -> None:
    """Write `diagnosis` as an .rrd that opens arranged; InputError if `path` cannot be written."""
    evidence = diagnosis.evidence
    fitted = list(compared_models(diagnosis).values())[-1]
    with recording_file(path) as recording:
        answer = rr.TextDocument(diagnosis_page(diagnosis).markdown(), media_type=rr.MediaType.MARKDOWN)
        recording.log("answer", answer, static=True)
        motions = operating_motions(
            evidence, fitted, diagnosis.sweeps, modification=modification_of(evidence, fitted.hypotheses)
        )
        moving = motions[-1] if motions else modal_motion(evidence, fitted)
        rig = animate_rig(recording, evidence, moving)
        for name, points in regions_of(diagnosis).items():
            recording.log(
                f"/motion/rig/where/{name}", rr.Points3D(points, colors=[(230, 159, 0, 128)], radii=0.002), static=True
            )
        joints = [animate_joint(recording, moving, joint) for joint in moving.joints]
        tabs: list[Any] = []
        for title, group, shown in (
            ("Sweeps", "sweeps", diagnosis.sweeps), ("Held out", "held_out", diagnosis.held_out)
        ):  # fmt: skip
            tabs += _by_resonance(recording, evidence, shown, title, group)
        broadband = _broadband(recording, diagnosis)
        if broadband:
            columns = len(evidence.channels)
            tabs.append(rrb.Grid(*broadband, grid_columns=columns, name="Broadband"))
        if diagnosis.sweeps:
            backbones = draw_backbones(recording, diagnosis)
            rows: list[Any] = [draw_residuals(recording, diagnosis)]
            rows += [rrb.Horizontal(*backbones)] if backbones else []
            tabs.append(rrb.Vertical(*rows, row_shares=[1.2, 1][: len(rows)], name="Residuals and backbone"))
        of_joints = _law(recording, diagnosis)
        if motions:
            of_joints += [view for n in range(len(joints)) for view in draw_loops(recording, motions, n)]
        if of_joints:
            tabs.append(rrb.Grid(*of_joints, grid_columns=2, name="Joints: law and loops"))
        l_curve = draw_l_curve(recording, diagnosis)
        fits = [draw_history(recording, diagnosis), *([l_curve] if l_curve else [])]
        tabs.append(rrb.Vertical(*fits, name="Fit"))
        layout = rrb.Horizontal(
            rrb.Vertical(
                rrb.TextDocumentView(origin="/answer", name="Answer"),
                rig,
                *([rrb.Horizontal(*joints)] if joints else []),
                row_shares=[3, 2, 2][: 2 + bool(joints)],
            ),
            rrb.Tabs(*tabs, active_tab=0),
            column_shares=[1, 2.6],
        )
        send_layout(recording, layout, timeline=SLOW_MOTION, play_state="playing", loop_mode="all")


def _by_resonance(
    recording: rr.RecordingStream, evidence: MeasuredData, sweeps: Sequence[SweepComparison], title: str, group: str
) -> list[rrb.Grid]:
    """A tab of charts for the sweeps about each resonance."""
    tabs = []
    for below, where, about in each_resonance(sweeps):
        views = _comparison(recording, evidence, about, f"{group}{below}")
        tabs.append(rrb.Grid(*views, grid_columns=len(views) // 2, name=f"{title}, {where}" if where else title))
    return tabs


def _comparison(
    recording: rr.RecordingStream, evidence: MeasuredData, sweeps: Sequence[SweepComparison], group: str
) -> list[rrb.Spatial2DView]:
    """Charts of receptance, one a channel, then of residuals, one a channel; all these sweeps in each."""
    quantity = {output.channel: output.quantity for output in evidence.outputs}
    levels = [(sweep.sweep, level_colour(i), "") for i, sweep in enumerate(sweeps)]
    receptances, residuals = [], []
    for o, channel in enumerate(sweeps[0].channels):
        label = per_force_label(channel, quantity[channel])
        curves, left = [], []
        for i, sweep in enumerate(sweeps):
            order, colour = np.argsort(sweep.frequency_Hz, kind="stable"), level_colour(i)
            x = sweep.frequency_Hz[order]
            for kind, style, size in KINDS:
                H = per_force(getattr(sweep, kind)[order, o], quantity[channel], x)
                curves.append(ChartCurve(f"{sweep.sweep}/{kind}", x, H, colour, style, size))
                if kind != "measured":
                    residual = np.maximum(getattr(sweep, f"residual_{kind}")[order, o], 0.1)
                    left.append(ChartCurve(f"{sweep.sweep}/{kind}", x, residual, colour, style, size))
        ends = np.array([min(np.min(curve.x) for curve in left), max(np.max(curve.x) for curve in left)])
        left.append(ChartCurve("noise", ends, np.ones(2), INK, size=1.0, legend=True))
        receptances.append(
            draw_chart(
                recording, f"/{group}/receptance/{channel}", f"{channel}: measured, before, after", "frequency, Hz",
                label, curves, told=[*levels, *((kind, INK, style) for kind, style, _ in KINDS)],
            )
        )  # fmt: skip
        residuals.append(
            draw_chart(
                recording, f"/{group}/residual/{channel}", f"{channel}: residuals", "frequency, Hz",
                f"residual of {channel}, σ of its noise", left, log="y",
                told=[*levels, *((kind, INK, style) for kind, style, _ in KINDS[:2])],
            )
        )  # fmt: skip
    return [*receptances, *residuals]


def _broadband(recording: rr.RecordingStream, diagnosis: Diagnosis) -> list[rrb.Spatial2DView]:
    """Measured and both models' responses of each broadband run, and below them the relative errors."""
    evidence, fitted = diagnosis.evidence, compared_models(diagnosis)
    responses, errors = [], []
    for i, data in enumerate(evidence.broadband):
        models = {kind: broadband_responses(evidence, fitted_model, i) for kind, fitted_model in fitted.items()}
        f, noise = data.frequency_Hz, 100 * np.sqrt(np.real(np.diagonal(data.relative_covariance, axis1=1, axis2=2)))
        for o, channel in enumerate(data.channels):
            curves, gaps = [], []
            for kind, H in models.items():
                style, gap = "dashed" if kind == "before" else "line", 100 * np.abs(H[:, o] / data.H[:, o] - 1)
                curves.append(ChartCurve(kind, f, np.abs(H[:, o]), KIND[kind], style, legend=True))
                gaps.append(ChartCurve(kind, f, gap, KIND[kind], size=1.5, legend=True))
            curves.append(ChartCurve("measured", f, np.abs(data.H[:, o]), MEASURED, "point", 1.5, legend=True))
            gaps.append(ChartCurve("noise", f, noise[:, o], NOISE, size=1.5, legend=True))
            path, label = f"/broadband/{i}/{channel}", response_label(channel, evidence.units[channel])
            responses.append(
                draw_chart(recording, path, f"{channel}, broadband", "frequency, Hz", label, curves, log="y")
            )
            errors.append(
                draw_chart(
                    recording, f"{path}_error", f"{channel}, error", "frequency, Hz",
                    f"relative error of {channel}, %", gaps, log="y",
                )
            )  # fmt: skip
    return [*responses, *errors]


def _law(recording: rr.RecordingStream, diagnosis: Diagnosis) -> list[rrb.Spatial2DView]:
    """Softening over opening and loss over slip, with bands of one standard deviation, of both models."""
    laws = laws_by_kind(diagnosis.evidence, compared_models(diagnosis))
    count = len(next(iter(laws.values()), ()))
    return [_law_chart(recording, {kind: bands[i] for kind, bands in laws.items()}) for i in range(count)]


def _law_chart(recording: rr.RecordingStream, bands: Mapping[str, LawBand]) -> rrb.Spatial2DView:
    """One function of the law by every model, framed by the last; data reach from one dashed line to the other."""
    accepted = list(bands.values())[-1]
    top, std = 1e-6 * accepted.value, 1e-6 * accepted.std
    chart = Chart(
        recording,
        "/law/" + "/".join(filter(None, (accepted.joint, accepted.quantity))),
        f"Joint's {accepted.title}",
        Axis.over(accepted.label, [1e6 * band.amplitude_m for band in bands.values()], log=True),
        Axis.over(f"{accepted.quantity} {accepted.function}, N/mm²", [np.zeros(1), top - std, top + std], margin=0.12),
    )
    for kind, band in bands.items():
        colour, x, y, std = KIND[kind], 1e6 * band.amplitude_m, 1e-6 * band.value, 1e-6 * band.std
        if not np.any((y > chart.y.ends[0]) & (y < chart.y.ends[1])):
            chart.tell(f"{kind}: {np.median(y):.3g}, off the axis", colour)
            continue
        chart.line(kind, x, y, colour, width=2.5, dashed=kind == "before")
        chart.line(f"{kind}/upper", x, y + std, colour, width=0.8, legend=False)
        chart.line(f"{kind}/lower", x, y - std, colour, width=0.8, legend=False)
    for i, end_m in enumerate(accepted.reach_m):
        if chart.x.ends[0] < 1e6 * end_m < chart.x.ends[1]:
            at = np.full(2, 1e6 * end_m)
            chart.line(f"reach/{i}", at, np.array(chart.y.ends), NOISE, width=1, dashed=True, legend=False)
    chart.tell("thin: one standard deviation", INK, "line")
    chart.tell("how far data reach", NOISE, "dashed")
    return chart.close()
