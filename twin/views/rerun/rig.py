"""A rig in rerun: its parts in space with joints, shaker and sensors, and its mode shapes moving."""

from pathlib import Path
from typing import Any

import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from twin.structure import drawn_parts, point_of
from twin.structure.modelled_rig import ModelledRig
from twin.views.rerun.motion import SLOW_MOTION, animate_parts, log_part, seen_from
from twin.views.rerun.rrd import recording_file, send_layout
from twin.views.rig_figure import DRIVE, JOINT, SENSOR, extent
from twin.views.style import level_colour, on_dark, rgb

MODES = 6


def save_rig_view(modelled: ModelledRig, path: Path) -> None:
    """Write a rig as an .rrd file, whole or not at all; InputError if `path` cannot be written."""
    with recording_file(path) as recording:
        send_layout(recording, _draw(recording, modelled), timeline=SLOW_MOTION)


def _draw(recording: rr.RecordingStream, modelled: ModelledRig) -> rrb.Horizontal:
    structure = modelled.structure
    parts = drawn_parts(structure)
    size = extent(parts)
    for number, part in enumerate(parts):
        log_part(recording, "rig", part, part.points, on_dark(level_colour(number)), 0.004 * size, static=True)
    for joint in structure.joints:
        recording.log(
            f"rig/joints/{rr.escape_entity_path_part(joint.name)}",
            rr.Points3D(joint.points, colors=[rgb(JOINT)], radii=0.008 * size), static=True,
        )  # fmt: skip
    rig = modelled.rig
    marks = [(name, place, DRIVE) for name, place in rig.drives.items()]
    marks += [(sensor.channel, rig.place_of(sensor.channel), SENSOR) for sensor in rig.response_sensors]
    for name, place, colour in marks:
        arrow = rr.Arrows3D(
            origins=[point_of(structure, place)], vectors=[0.1 * size * np.array(place.direction)],
            colors=[rgb(colour)], radii=0.005 * size, labels=[name],
        )  # fmt: skip
        recording.log(f"rig/at/{rr.escape_entity_path_part(name)}", arrow, static=True)
    modes: list[Any] = []
    for mode in range(min(MODES, modelled.modes.Phi.shape[1])):
        moved = [part.rows @ modelled.modes.Phi[:, mode] for part in parts]
        title = f"Mode {mode + 1}, {modelled.modes.frequency_Hz[mode]:.5g} Hz"
        modes.append(animate_parts(recording, f"/modes/{mode + 1}", title, parts, moved))
    at_rest = rrb.Spatial3DView(origin="/rig", name="Rig", **seen_from(parts))
    return rrb.Horizontal(at_rest, rrb.Grid(*modes), column_shares=[1, 2])
