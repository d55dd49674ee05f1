"""Motions in slow motion: any rig in space, each joint with its opening and slip enlarged, the joints' loops."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.arrays import Array
from twin.identify.measured_data import MeasuredData
from twin.structure import DrawnPart, drawn_parts
from twin.views.curves import sensor_places
from twin.views.operating import JointMotion, Motion
from twin.views.plot import Axis, Plot, PlotCurve
from twin.views.rerun.chart import Chart, draw_chart
from twin.views.rig_figure import drawn_larger, extent
from twin.views.style import INK, level_colour, on_dark

OPEN, PRESSED = "#d55e00", "#0072b2"
SLOW_MOTION = "slow_motion"
"""Timeline of the animations."""
FRAMES = 40
THICK = 0.003
"""Radius of a line, over the size of the rig; of a point without lines three times as much."""


def cycle() -> Iterator[tuple[float, complex]]:
    """Times of one cycle, and the phase's turn then; at rest first, where the motion is in phase with the force."""
    for turns in np.arange(FRAMES + 1) / FRAMES:
        yield 2.0 * float(turns), complex(np.exp(2j * np.pi * turns))


def log_part(
    recording: rr.RecordingStream, path: str, part: DrawnPart, points: Array, colour: Any, radius_m: float, *,
    static: bool = False,
) -> None:  # fmt: skip
    """Draw a part with its points (k, 3) there; one without lines as points."""
    shape: Any = (
        rr.LineStrips3D(points[part.edges].astype(np.float32), colors=[colour], radii=radius_m)
        if len(part.edges)
        else rr.Points3D(points, colors=[colour], radii=3 * radius_m)
    )
    recording.log(f"{path}/{rr.escape_entity_path_part(part.name)}", shape, static=static)


def animate_parts(
    recording: rr.RecordingStream, path: str, name: str, parts: Sequence[DrawnPart], moved: Sequence[Array], *,
    marked: Sequence[tuple[DrawnPart, Array]] = (),
) -> rrb.Spatial3DView:  # fmt: skip
    """One cycle of complex displacements (3, k) of each part's points, drawn larger, over the parts at rest.

    Parameters
    ----------
    marked
        Places that move with them, and their displacements.
    """
    size, larger = extent(parts), drawn_larger(moved, extent(parts))
    for part in parts:
        if len(part.edges):
            log_part(recording, f"{path}/rest", part, part.points, (95, 95, 95), THICK / 3 * size, static=True)
    for time_s, turned in cycle():
        recording.set_time(SLOW_MOTION, duration=time_s)
        for number, (part, motion) in enumerate([*zip(parts, moved, strict=True), *marked]):
            points = part.points + larger * np.real(turned * motion).T
            log_part(recording, path, part, points, on_dark(level_colour(number)), THICK * size)
    recording.reset_time()
    return rrb.Spatial3DView(origin=path, name=name, **seen_from(parts))


def seen_from(parts: Sequence[DrawnPart]) -> dict[str, Any]:
    """Where to look from: straight onto a plane frame, from above and aside onto anything else."""
    points = np.concatenate([part.points for part in parts])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    flat = np.ptp(points[:, 2]) == 0
    away = np.array([0.0, 0.0, 1.6]) if flat else np.array([0.5, -1.2, 0.9])
    up = (0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0)
    eye = rrb.EyeControls3D(position=middle + extent(parts) * away, look_target=middle, eye_up=up)
    return {"eye_controls": eye, "line_grid": rrb.LineGrid3D(visible=False)}


def animate_rig(recording: rr.RecordingStream, evidence: MeasuredData, motion: Motion) -> rrb.Spatial3DView:
    """The whole rig and its sensors."""
    return animate_parts(
        recording, "/motion/rig", f"Motion, {motion.title}", drawn_parts(evidence.model.structure), motion.parts,
        marked=[(sensor_places(evidence), motion.sensors)],
    )  # fmt: skip


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
    chart.draw(PlotCurve("first", x, np.zeros(len(x)), INK, size=4.0))
    chart.draw(PlotCurve("rest", x, np.ones(len(x)), "#5f5f5f", "dashed", 1.0))
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
            curves.append(PlotCurve(f"{i}", 1e3 * np.real(moved * turned), np.real(force * turned), level_colour(i)))
            told.append((motion.title, level_colour(i), "line"))
        plot = Plot.over(title, x_label, y_label, curves, told=told, margin=0.1)
        views.append(draw_chart(recording, f"/loops/{joint}/{name}", plot))
    return views
