"""Parts of a rig in space in rerun: at rest, and moving in slow motion."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.arrays import Array
from twin.structure import DrawnPart
from twin.views.rig_figure import extent
from twin.views.style import level_colour, on_dark

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
    recording: rr.RecordingStream, path: str, parts: Sequence[DrawnPart], moved: Sequence[Array], larger: float
) -> None:
    """One cycle of complex displacements (3, k) of each part's points, drawn `larger`, over the parts at rest."""
    size = extent(parts)
    for part in parts:
        if len(part.edges):
            log_part(recording, f"{path}/rest", part, part.points, (95, 95, 95), THICK / 3 * size, static=True)
    for time_s, turned in cycle():
        recording.set_time(SLOW_MOTION, duration=time_s)
        for number, (part, motion) in enumerate(zip(parts, moved, strict=True)):
            points = part.points + larger * np.real(turned * motion).T
            log_part(recording, path, part, points, on_dark(level_colour(number)), THICK * size)
    recording.reset_time()


def seen_from(parts: Sequence[DrawnPart]) -> dict[str, Any]:
    """Where to look from: straight onto a plane frame, from above and aside onto anything else."""
    points = np.concatenate([part.points for part in parts])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    flat = np.ptp(points[:, 2]) == 0
    away = np.array([0.0, 0.0, 1.6]) if flat else np.array([0.5, -1.2, 0.9])
    up = (0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0)
    eye = rrb.EyeControls3D(position=middle + extent(parts) * away, look_target=middle, eye_up=up)
    return {"eye_controls": eye, "line_grid": rrb.LineGrid3D(visible=False)}
