"""A diagnosis in rerun: the answer, measured against both models, residuals, the joint's law and loops, the motion."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import rerun as rr
import rerun.blueprint as rrb

from twin.diagnose.answer.comparison import SweepComparison
from twin.diagnose.answer.result import Diagnosis
from twin.diagnose.fit_problem import modification_of
from twin.identify.measured_data import MeasuredData
from twin.views.curves import compared_models, each_resonance
from twin.views.operating import modal_motion, operating_motions
from twin.views.plots import broadband_plots, law_plots, sweep_colours, sweep_plots
from twin.views.reports.diagnosis import diagnosis_page
from twin.views.reports.where import regions_of
from twin.views.rerun.chart import draw_chart
from twin.views.rerun.fit import draw_backbones, draw_history, draw_l_curve, draw_residuals
from twin.views.rerun.motion import SLOW_MOTION, animate_joint, animate_rig, draw_loops
from twin.views.rerun.rrd import recording_file, send_layout


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
        of_joints = [
            draw_chart(recording, f"/law/{name}", plot)
            for name, plot in law_plots(evidence, compared_models(diagnosis)).items()
        ]
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
    """A tab for the sweeps about each resonance: receptances, phases and residuals, a chart for each channel."""
    tabs, colours = [], sweep_colours(sweeps)
    for below, where, about in each_resonance(sweeps):
        kinds = sweep_plots(evidence, about, colours, ("before", "after"))
        views = [
            draw_chart(recording, f"/{group}{below}/{what}/{channel}", plot)
            for what, plots in zip(("receptance", "phase", "residual"), kinds, strict=True)
            for channel, plot in zip(about[0].channels, plots, strict=True)
        ]
        tabs.append(
            rrb.Grid(*views, grid_columns=len(views) // len(kinds), name=f"{title}, {where}" if where else title)
        )
    return tabs


def _broadband(recording: rr.RecordingStream, diagnosis: Diagnosis) -> list[rrb.Spatial2DView]:
    """Measured and both models' responses of each broadband run, and below them the relative errors."""
    evidence, models = diagnosis.evidence, compared_models(diagnosis)
    rows: tuple[list[rrb.Spatial2DView], ...] = ([], [])
    for i, data in enumerate(evidence.broadband):
        for row, plots, more in zip(rows, broadband_plots(evidence, models, i), ("", "_error"), strict=True):
            row += [
                draw_chart(recording, f"/broadband/{i}/{channel}{more}", plot)
                for channel, plot in zip(data.channels, plots, strict=True)
            ]
    return [view for row in rows for view in row]
