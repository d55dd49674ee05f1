"""The first mode in slow motion: both beams' deflection lines, and the joint with its opening and slip enlarged."""

from __future__ import annotations

from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.views.chart import Chart
from twin.views.curves import ModeShape
from twin.views.style import AFTER, BEFORE, INK, on_dark

__all__ = ["SLOW_MOTION", "animate_joint", "animate_mode"]

Array = NDArray[Any]

SLOW_MOTION = "slow_motion"
"""Timeline of the animations."""
FRAMES, CYCLE_S = 40, 2.0
LIFT = 0.16
"""Distance at which the two beams are drawn apart, in units of the largest deflection."""
OPEN, PRESSED = "#d55e00", "#0072b2"


def animate_mode(recording: rr.RecordingStream, evidence: Evidence, shape: ModeShape) -> rrb.Spatial2DView:
    """The whole rig; the beams' lines are drawn apart so that both can be seen."""
    chart = Chart(
        recording,
        "/mode/rig",
        f"Mode {shape.number}, {shape.frequency_Hz:.5g} Hz",
        "position from the clamp, m",
        "deflection, tip amplitude 1",
        (0.0, float(shape.upper_x[-1])),
        (-1.3, 1.3),
    )
    chart.line("rest/lower", shape.lower_x, np.zeros(len(shape.lower_x)), "#5f5f5f", width=1, dashed=True, legend=False)
    lift = np.full(len(shape.upper_x), LIFT)
    chart.line("rest/upper", shape.upper_x, lift, "#5f5f5f", width=1, dashed=True, legend=False)
    chart.tell("lower beam", AFTER, "line")
    chart.tell("upper beam", BEFORE, "line")
    chart.tell("sensors", INK, "point")
    places = np.array([output.position_m for output in evidence.outputs])
    for time_s, size in _frames():
        recording.set_time(SLOW_MOTION, duration=time_s)
        chart.move("lower", [(shape.lower_x, size * shape.lower)], [on_dark(AFTER)], width=4)
        chart.move("upper", [(shape.upper_x, LIFT + size * shape.upper)], [on_dark(BEFORE)], width=4)
        chart.move_points("sensors", places, _deflection(shape, places, size), INK)
    recording.reset_time()
    chart.close()
    return chart.view()


def animate_joint(recording: rr.RecordingStream, shape: ModeShape) -> rrb.Spatial2DView:
    """The overlap as seen from the lower beam: opening and slip enlarged, coloured by opening or pressing."""
    x = shape.layer_x
    slip = np.interp(x, shape.shear_x, shape.slip)
    across = 0.45 / max(float(np.max(np.abs(shape.opening))), 1e-12)
    length = float(x[-1] - x[0])
    along = 0.04 * length / max(float(np.max(np.abs(slip))), 1e-12)
    chart = Chart(
        recording,
        "/mode/joint",
        "Joint, enlarged",
        "position from the clamp, m",
        f"gap: opening × {across:.3g}, slip × {along:.3g}",
        (float(x[0]) - 0.06 * length, float(x[-1]) + 0.06 * length),
        (-0.2, 1.8),
    )
    chart.line("lower beam", x, np.zeros(len(x)), INK, width=4, legend=False)
    chart.line("rest", x, np.ones(len(x)), "#5f5f5f", width=1, dashed=True, legend=False)
    chart.tell("opens", OPEN, "line")
    chart.tell("is pressed", PRESSED, "line")
    for time_s, size in _frames():
        recording.set_time(SLOW_MOTION, duration=time_s)
        height, shift = 1 + size * across * shape.opening, size * along * slip
        chart.move("upper", [(x + shift, height)], [on_dark(INK)], width=4)
        threads = [(np.array([a, a + s]), np.array([0.0, h])) for a, s, h in zip(x, shift, height, strict=True)]
        chart.move("layer", threads, [on_dark(OPEN if h > 1 else PRESSED) for h in height], width=2)
    recording.reset_time()
    chart.close()
    return chart.view()


def _frames() -> list[tuple[float, float]]:
    """Times of one cycle and the mode's size then."""
    return [(CYCLE_S * k / FRAMES, float(np.sin(2 * np.pi * k / FRAMES))) for k in range(FRAMES + 1)]


def _deflection(shape: ModeShape, position_m: Array, size: float) -> Array:
    """Where a sensor is drawn: on the lower beam up to its end, on the upper one from there."""
    lower = size * np.interp(position_m, shape.lower_x, shape.lower)
    upper = LIFT + size * np.interp(position_m, shape.upper_x, shape.upper)
    return np.where(position_m <= shape.lower_x[-1], lower, upper)
