"""Motions slowed down: the beams' deflection lines, and the joint with its opening and slip enlarged; its loops."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from twin.identify.measured_data import MeasuredData
from twin.views.chart import Chart, common_range
from twin.views.curves import sensor_deflections
from twin.views.operating import Motion
from twin.views.style import AFTER, BEFORE, INK, level_colour, on_dark

__all__ = ["SLOW_MOTION", "animate_joint", "animate_rig", "draw_loops"]

Array = NDArray[Any]

SLOW_MOTION = "slow_motion"
"""Timeline of the animations."""
FRAMES, CYCLE_S = 40, 2.0
LIFT = 0.16
"""Distance at which beams are drawn apart, in units of the largest deflection."""
BEAM_COLOURS = (AFTER, BEFORE, "#009e73", "#cc79a7", "#e69f00")
OPEN, PRESSED = "#d55e00", "#0072b2"


def animate_rig(recording: rr.RecordingStream, evidence: MeasuredData, motion: Motion) -> rrb.Spatial2DView:
    """The whole rig; the beams' lines are drawn apart so that all can be seen."""
    most = float(np.max(np.abs(np.concatenate([beam.value for beam in motion.beams]))))
    lift = LIFT * most
    ends = [beam.x[i] for beam in motion.beams for i in (0, -1)]
    chart = Chart(
        recording,
        "/motion/rig",
        f"Motion, {motion.title}",
        "position from the clamp, m",
        f"deflection, {motion.unit}; beams lifted apart",
        (float(min(ends)), float(max(ends))),
        (-1.2 * most, 1.2 * most + lift * (len(motion.beams) - 1)),
        width=1600.0,
        text=1.8,
    )
    for n, beam in enumerate(motion.beams):
        rest = f"rest/{rr.escape_entity_path_part(beam.name)}"
        chart.line(rest, beam.x, np.full(len(beam.x), n * lift), "#5f5f5f", width=1, legend=False)
        chart.tell(f"{beam.name} beam", BEAM_COLOURS[n % len(BEAM_COLOURS)], "line")
    chart.tell("sensors", INK, "point")
    for time_s, turned in _frames():
        recording.set_time(SLOW_MOTION, duration=time_s)
        moved = [replace(beam, value=n * lift + np.real(turned * beam.value)) for n, beam in enumerate(motion.beams)]
        for n, beam in enumerate(moved):
            line = f"beams/{rr.escape_entity_path_part(beam.name)}"
            chart.move(line, [(beam.x, beam.value)], [on_dark(BEAM_COLOURS[n % len(BEAM_COLOURS)])], width=4)
        chart.move_points("sensors", *sensor_deflections(evidence, moved), INK)
    recording.reset_time()
    chart.close()
    return chart.view()


def animate_joint(recording: rr.RecordingStream, motion: Motion) -> rrb.Spatial2DView:
    """The overlap as seen from the lower beam: opening and slip enlarged, coloured by opening or pressing."""
    x = motion.layer_x
    slip = np.interp(x, motion.shear_x, motion.slip)
    across = 0.45 / max(float(np.max(np.abs(motion.opening))), 1e-12)
    length = float(x[-1] - x[0])
    along = 0.04 * length / max(float(np.max(np.abs(slip))), 1e-12)
    widest, farthest = np.max(np.abs(motion.opening)), np.max(np.abs(slip))
    metric = motion.unit == "mm"
    opens = f"opening up to {1e3 * widest:.3g} µm" if metric else f"opening × {across:.3g}"
    slides = f"slip up to {1e3 * farthest:.3g} µm" if metric else f"slip × {along:.3g}"
    chart = Chart(
        recording,
        "/motion/joint",
        f"Joint enlarged, {motion.title}",
        "position from the clamp, m",
        f"{opens}, {slides}",
        (float(x[0]) - 0.06 * length, float(x[-1]) + 0.06 * length),
        (-0.2, 1.8),
        bare_y=True,
        width=1600.0,
        text=1.8,
    )
    chart.line("lower beam", x, np.zeros(len(x)), INK, width=4, legend=False)
    chart.line("rest", x, np.ones(len(x)), "#5f5f5f", width=1, dashed=True, legend=False)
    chart.tell("opens", OPEN, "line")
    chart.tell("is pressed", PRESSED, "line")
    for time_s, turned in _frames():
        recording.set_time(SLOW_MOTION, duration=time_s)
        height, shift = 1 + across * np.real(turned * motion.opening), along * np.real(turned * slip)
        chart.move("upper", [(x + shift, height)], [on_dark(INK)], width=4)
        threads = [(np.array([a, a + s]), np.array([0.0, h])) for a, s, h in zip(x, shift, height, strict=True)]
        chart.move("layer", threads, [on_dark(OPEN if h > 1 else PRESSED) for h in height], width=2)
    recording.reset_time()
    chart.close()
    return chart.view()


def draw_loops(recording: rr.RecordingStream, motions: Sequence[Motion]) -> list[rrb.Spatial2DView]:
    """Force against displacement over one cycle, along and across the joint, at the top of each sweep."""
    turned = np.exp(2j * np.pi * np.arange(121) / 120)
    views = []
    for name, title, x_label, y_label in (
        ("slip", "Joint's loops, along", "slip where it is farthest, µm", "shear force there, N"),
        ("opening", "Joint's loops, across", "opening where it is widest, µm", "normal force there, N"),
    ):
        loops = []
        for motion in motions:
            moved, force = (motion.farthest, motion.shear_N) if name == "slip" else (motion.widest, motion.peel_N)
            loops.append((motion.title, 1e3 * np.real(moved * turned), np.real(force * turned)))
        chart = Chart(
            recording,
            f"/loops/{name}",
            title,
            x_label,
            y_label,
            common_range([x for _, x, _ in loops], margin=0.1),
            common_range([y for *_, y in loops], margin=0.1),
        )
        for i, (text, x, y) in enumerate(loops):
            chart.line(f"{i}", x, y, level_colour(i), width=2, legend=False)
            chart.tell(text, level_colour(i), "line")
        chart.close()
        views.append(chart.view())
    return views


def _frames() -> list[tuple[float, complex]]:
    """Times of one cycle, and the phase's turn then; at rest first, where the motion is in phase with the force."""
    turns = np.arange(FRAMES + 1) / FRAMES
    return [(CYCLE_S * float(t), complex(np.exp(2j * np.pi * t))) for t in turns]
