"""A rig in rerun: its parts in space with joints, shaker and sensors, and its mode shapes moving."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb
from numpy.typing import NDArray

from twin.structure import DrawnPart, drawn_parts, point_of
from twin.structure.modelled_rig import ModelledRig
from twin.views.rig_figure import extent, mode_scale, unit_arrow
from twin.views.rrd import recording_file, send_layout
from twin.views.style import level_colour, on_dark, rgb

__all__ = ["save_rig_view"]

Array = NDArray[Any]

SLOW_MOTION = "slow_motion"
FRAMES, CYCLE_S = 32, 2.0
MODES = 6
JOINT, DRIVE, SENSOR, REST = "#d55e00", "#cc79a7", "#009e73", (95, 95, 95)


def save_rig_view(modelled: ModelledRig, path: Path) -> None:
    """Write a rig as an .rrd file, whole or not at all.

    Raises
    ------
    InputError
        If `path` cannot be written.
    """
    with recording_file(path) as recording:
        send_layout(recording, _draw(recording, modelled), timeline=SLOW_MOTION)


def _draw(recording: rr.RecordingStream, modelled: ModelledRig) -> rrb.Horizontal:
    structure = modelled.structure
    parts = drawn_parts(structure)
    size = extent(parts)
    for number, part in enumerate(parts):
        lines = rr.LineStrips3D(
            part.points[part.edges].astype(np.float32), colors=[on_dark(level_colour(number))], radii=0.004 * size
        )
        recording.log(f"rig/{rr.escape_entity_path_part(part.name)}", lines, static=True)
    for joint in structure.joints:
        recording.log(
            f"rig/joints/{rr.escape_entity_path_part(joint.name)}",
            rr.Points3D(joint.points, colors=[rgb(JOINT)], radii=0.008 * size), static=True,
        )  # fmt: skip
    rig = modelled.rig
    marks = [("drive", rig.drive_place, DRIVE)]
    marks += [(sensor.channel, rig.place_of(sensor.channel), SENSOR) for sensor in rig.response_sensors]
    for name, place, colour in marks:
        arrow = rr.Arrows3D(
            origins=[point_of(structure, place)], vectors=[unit_arrow(place.direction, 0.1 * size)],
            colors=[rgb(colour)], radii=0.005 * size, labels=[name],
        )  # fmt: skip
        recording.log(f"rig/at/{rr.escape_entity_path_part(name)}", arrow, static=True)
    seen = _seen_from(parts, size)
    views: list[Any] = [rrb.Spatial3DView(origin="/rig", name="Rig", **seen)]
    for mode in range(min(MODES, modelled.modes.Phi.shape[1])):
        phi = modelled.modes.Phi[:, mode]
        scale = mode_scale(parts, phi, size)
        for part in parts:
            rest = rr.LineStrips3D(part.points[part.edges].astype(np.float32), colors=[REST], radii=0.001 * size)
            recording.log(f"modes/{mode + 1}/rest/{rr.escape_entity_path_part(part.name)}", rest, static=True)
        for number, part in enumerate(parts):
            moved = scale * (part.rows @ phi).T
            path = f"modes/{mode + 1}/{rr.escape_entity_path_part(part.name)}"
            for frame in range(FRAMES + 1):
                recording.set_time(SLOW_MOTION, duration=CYCLE_S * frame / FRAMES)
                points = part.points + np.cos(2 * np.pi * frame / FRAMES) * moved
                recording.log(path, rr.LineStrips3D(
                    points[part.edges].astype(np.float32), colors=[on_dark(level_colour(number))], radii=0.003 * size
                ))  # fmt: skip
        recording.reset_time()
        title = f"Mode {mode + 1}, {modelled.modes.frequency_Hz[mode]:.5g} Hz"
        views.append(rrb.Spatial3DView(origin=f"/modes/{mode + 1}", name=title, **seen))
    return rrb.Horizontal(views[0], rrb.Grid(*views[1:]), column_shares=[1, 2])


def _seen_from(parts: Sequence[DrawnPart], size: float) -> dict[str, Any]:
    """Where to look from: straight onto a plane frame, from above and aside onto anything else."""
    points = np.concatenate([part.points for part in parts])
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    flat = np.ptp(points[:, 2]) == 0
    away = np.array([0.0, 0.0, 1.6]) if flat else np.array([0.5, -1.2, 0.9])
    up = (0.0, 1.0, 0.0) if flat else (0.0, 0.0, 1.0)
    eye = rrb.EyeControls3D(position=middle + size * away, look_target=middle, eye_up=up)
    return {"eye_controls": eye, "line_grid": rrb.LineGrid3D(visible=False)}
