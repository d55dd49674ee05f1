"""Motions slowed down: the rig in space, and each joint with its opening and slip enlarged; the joints' loops."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.identify.measured_data import MeasuredData
from twin.structure import drawn_parts
from twin.views.curves import sensor_places
from twin.views.operating import JointMotion, Motion
from twin.views.rerun.chart import Axis, Chart, ChartCurve, draw_chart
from twin.views.rerun.parts import SLOW_MOTION, animate_parts, cycle, seen_from
from twin.views.rig_figure import drawn_larger, extent
from twin.views.style import INK, level_colour, on_dark

OPEN, PRESSED = "#d55e00", "#0072b2"


def animate_rig(recording: rr.RecordingStream, evidence: MeasuredData, motion: Motion) -> rrb.Spatial3DView:
    """The whole rig and its sensors."""
    parts = drawn_parts(evidence.model.structure)
    larger = drawn_larger(motion.parts, extent(parts))
    drawn, moved = [*parts, sensor_places(evidence)], [*motion.parts, motion.sensors]
    animate_parts(recording, "/motion/rig", drawn, moved, larger)
    return rrb.Spatial3DView(origin="/motion/rig", name=f"Motion, {motion.title}", **seen_from(parts))


def animate_joint(recording: rr.RecordingStream, motion: Motion, joint: JointMotion) -> rrb.Spatial2DView:
    """A joint as seen from its first part: opening and slip enlarged, coloured by opening or pressing."""
    x, slip = joint.x, joint.slip
    across = 0.45 / max(float(np.max(np.abs(joint.opening))), 1e-12)
    length = max(float(np.ptp(x)), 1e-3)
    along = 0.04 * length / max(float(np.max(np.abs(slip))), 1e-12)
    widest, farthest = np.max(np.abs(joint.opening)), np.max(np.abs(slip))
    metric = motion.unit == "mm"
    opens = f"opening up to {1e3 * widest:.3g} µm" if metric else f"opening × {across:.3g}"
    slides = f"slip up to {1e3 * farthest:.3g} µm" if metric else f"slip × {along:.3g}"
    chart = Chart(
        recording,
        f"/motion/joint/{joint.name}",
        f"{joint.name} enlarged, {motion.title}",
        Axis("position along the joint, m", (float(x[0]) - 0.06 * length, float(x[-1]) + 0.06 * length)),
        Axis(f"{opens}, {slides}", (-0.2, 1.8), bare=True),
        width=1600.0,
        text=1.8,
    )
    chart.line("first", x, np.zeros(len(x)), INK, width=4, legend=False)
    chart.line("rest", x, np.ones(len(x)), "#5f5f5f", width=1, dashed=True, legend=False)
    chart.tell("opens", OPEN, "line")
    chart.tell("is pressed", PRESSED, "line")
    for time_s, turned in cycle():
        recording.set_time(SLOW_MOTION, duration=time_s)
        height, shift = 1 + across * np.real(turned * joint.opening), along * np.real(turned * slip)
        chart.move("second", [(x + shift, height)], [on_dark(INK)], width=4)
        threads = [(np.array([a, a + s]), np.array([0.0, h])) for a, s, h in zip(x, shift, height, strict=True)]
        chart.move("layer", threads, [on_dark(OPEN if h > 1 else PRESSED) for h in height], width=2)
    recording.reset_time()
    return chart.close()


def draw_loops(recording: rr.RecordingStream, motions: Sequence[Motion], number: int) -> list[rrb.Spatial2DView]:
    """Force against displacement over one cycle, along and across a joint, at the top of each sweep."""
    turned = np.exp(2j * np.pi * np.arange(121) / 120)
    joint = motions[0].joints[number].name
    views = []
    for name, title, x_label, y_label in (
        ("slip", f"Loops of {joint}, along", "slip where it is farthest, µm", "shear force there, N"),
        ("opening", f"Loops of {joint}, across", "opening where it is widest, µm", "normal force there, N"),
    ):
        curves, told = [], []
        for i, motion in enumerate(motions):
            own = motion.joints[number]
            moved, force = (own.farthest, own.shear_N) if name == "slip" else (own.widest, own.peel_N)
            curves.append(ChartCurve(f"{i}", 1e3 * np.real(moved * turned), np.real(force * turned), level_colour(i)))
            told.append((motion.title, level_colour(i), "line"))
        views.append(
            draw_chart(
                recording, f"/loops/{joint}/{name}", title, x_label, y_label, curves, told=told, margin=0.1
            )
        )  # fmt: skip
    return views
