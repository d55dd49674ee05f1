"""The backbone of sweeps about one resonance: frequency and displacement of each one's largest step, by level."""

from collections.abc import Sequence

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from recordings.run import Run
from twin.views.curves import SteppedSweep
from twin.views.receptance import farthest_response, per_force, reading_label
from twin.views.rerun.chart import ChartCurve, draw_chart
from twin.views.style import INK, level_colour


def draw_backbone(
    recording: rr.RecordingStream, run: Run, reduced: Sequence[SteppedSweep], *, path: str = "/backbone"
) -> rrb.Spatial2DView | None:
    """Of the response channel farthest from the clamp; nothing where fewer than two sweeps show a top."""
    shown = [sweep for sweep in reduced if len(sweep.frequency_Hz) > 2 and sweep.harmonics]
    if len(shown) < 2:
        return None
    farthest = farthest_response(run.channels[name] for name in shown[0].harmonics)
    if farthest is None:
        return None
    channel = farthest.name
    tops = []
    for sweep in shown:
        fundamental, quantity = sweep.harmonics[channel][:, 0], run.channels[channel].quantity
        displacement = per_force(fundamental, quantity, sweep.frequency_Hz)
        top = int(np.nanargmax(displacement))
        tops.append((float(sweep.frequency_Hz[top]), float(displacement[top])))
    x, y = np.array(sorted(tops, key=lambda top: top[1])).T
    levels = list(dict.fromkeys(sweep.level for sweep in shown))
    curves, told = [ChartCurve("line", x, y, INK, "dashed", 1.0)], []
    for sweep, (frequency, size) in zip(shown, tops, strict=True):
        colour = level_colour(levels.index(sweep.level))
        curves.append(ChartCurve(sweep.name, np.array([frequency]), np.array([size]), colour, "point", 5.0))
        told.append((sweep.level, colour, "point"))
    return draw_chart(
        recording, path, f"Backbone, {channel}", "frequency of the largest step, Hz",
        reading_label(channel, farthest.quantity), curves, told=told, margin=0.15, width=1250.0, text=1.8,
    )  # fmt: skip
