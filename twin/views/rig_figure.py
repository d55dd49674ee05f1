"""A rig as a picture: its parts, joints, supports, shaker and sensors, and its first mode shapes."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from mpl_toolkits.mplot3d.art3d import Line3DCollection  # type: ignore[import-untyped]

from twin.arrays import Array
from twin.identify.measured_data import MeasuredData
from twin.rigs import Place, Rig
from twin.structure import DrawnPart, Structure, drawn_parts, point_of
from twin.structure.modelled_rig import ModelledRig
from twin.views.curves import Fitted, modelled_by, sensor_places
from twin.views.drawing import WIDTH_IN, Drawing, legend
from twin.views.style import level_colour

JOINT, DRIVE, SENSOR, SUPPORT = "#d55e00", "#cc79a7", "#009e73", "#5f5f5f"
MODES = 4


def rig_figure(modelled: ModelledRig) -> Figure:
    """The rig at rest above, and its first modes below."""
    structure = modelled.structure
    parts = drawn_parts(structure)
    flat = flat_parts(parts)
    figure = Drawing(figsize=(10.0, 8.4), layout="constrained")
    grid = figure.add_gridspec(3, 2, height_ratios=(1.5, 1.0, 1.0))
    options = {} if flat else {"projection": "3d"}
    axes = figure.add_subplot(grid[0, :], **options)
    for number, part in enumerate(parts):
        _draw(axes, part.points, part.edges, level_colour(number), flat=flat, width=2.5, label=part.name)
    rig = modelled.rig
    draw_fittings(axes, structure, rig, size=extent(parts), flat=flat)
    axes.set_title(f"{rig.name}: {rig.sentence}", fontsize=10, wrap=True)
    _frame(axes, parts, flat=flat)
    for number in range(min(MODES, modelled.modes.Phi.shape[1])):
        below = figure.add_subplot(grid[1 + number // 2, number % 2], **options)
        draw_mode(below, modelled, number, parts, None, flat=flat)
    legend(figure, columns=8)
    return figure


def draw_fittings(axes: Any, structure: Structure, rig: Rig, *, size: float, flat: bool) -> None:
    """Joints, supports, drives and sensors."""
    for joint in structure.joints:
        scatter(axes, joint.points, JOINT, "o", 26, flat=flat, label="joint")
    for support in structure.layout.supports:
        held = point_of(structure, Place(support.part, support.at, (0.0, 1.0, 0.0)))
        scatter(axes, held[None], SUPPORT, "^", 110, flat=flat, label="support")
    looked_at = [(place, DRIVE, "drive") for place in rig.drives.values()]
    looked_at += [(rig.place_of(sensor.channel), SENSOR, "sensor") for sensor in rig.response_sensors]
    for place, colour, name in looked_at:
        start, arrow = point_of(structure, place), 0.08 * size * np.array(place.direction)
        _draw(axes, np.array([start, start + arrow]), np.array([[0, 1]]), colour, flat=flat, width=2.0)
        scatter(axes, start[None], colour, "s", 30, flat=flat, label=name)


def modes_figure(evidence: MeasuredData, model: Fitted) -> Figure:
    """The first modes of a fitted model in space, over the parts at rest, with the sensors marked."""
    modelled = modelled_by(evidence, model)
    parts = drawn_parts(modelled.structure)
    flat = flat_parts(parts)
    marked = sensor_places(evidence)
    count = min(MODES, modelled.modes.Phi.shape[1])
    rows = -(-count // 2)
    figure = Drawing(figsize=(WIDTH_IN, (2.4 if flat else 3.4) * rows + 0.4), layout="constrained")
    for number in range(count):
        axes = figure.add_subplot(rows, 2, number + 1, **({} if flat else {"projection": "3d"}))
        draw_mode(axes, modelled, number, parts, marked, flat=flat)
    legend(figure)
    return figure


def drawn_larger(moved: Sequence[Array], size: float) -> float:
    """What displacements of all parts are drawn larger by."""
    largest = max(float(np.max(np.abs(part))) for part in moved)
    return 0.12 * size / largest if largest else 0.0


def extent(parts: Sequence[DrawnPart]) -> float:
    """Longest side of the box that holds all parts, m."""
    points = np.concatenate([part.points for part in parts])
    return float(np.max(np.ptp(points, axis=0)))


def flat_parts(parts: Sequence[DrawnPart]) -> bool:
    """Whether all lies and moves in the plane z = 0."""
    return not any(np.any(part.points[:, 2]) or np.any(part.rows[2]) for part in parts)


def draw_mode(
    axes: Any, modelled: ModelledRig, number: int, parts: Sequence[DrawnPart], marked: DrawnPart | None, *, flat: bool
) -> None:
    """One mode over the parts at rest, and what is marked where it has moved to."""
    phi = modelled.modes.Phi[:, number]
    scale = drawn_larger([part.rows @ phi for part in parts], extent(parts))
    for k, part in enumerate(parts):
        _draw(axes, part.points, part.edges, "#bbbbbb", flat=flat, width=0.8)
        moved = part.points + scale * (part.rows @ phi).T
        _draw(axes, moved, part.edges, level_colour(k), flat=flat, width=1.8, label=part.name)
    if marked is not None:
        moved = marked.points + scale * (marked.rows @ phi).T
        scatter(axes, moved, SENSOR, "s", 20, flat=flat, label=marked.name)
    axes.set_title(f"mode {number + 1}: {modelled.modes.frequency_Hz[number]:.5g} Hz", fontsize=10)
    _frame(axes, parts, flat=flat)


def _draw(
    axes: Any, points: Array, edges: Array, colour: str, *, flat: bool, width: float, label: str | None = None
) -> None:
    if flat:
        lines = LineCollection(list(points[edges][:, :, :2]), colors=colour, linewidths=width, label=label)
        axes.add_collection(lines)
    else:
        axes.add_collection3d(Line3DCollection(points[edges], colors=colour, linewidths=0.5 * width, label=label))


def scatter(axes: Any, points: Array, colour: str, mark: str, size: float, *, flat: bool, label: str) -> None:
    """Mark points (k, 3)."""
    axes.scatter(*(points.T[:2] if flat else points.T), c=colour, marker=mark, s=size, zorder=3, label=label)


def draw_rest(figure: Figure, parts: Sequence[DrawnPart]) -> tuple[Any, bool]:
    """Axes with the parts at rest, and whether these are flat."""
    flat = flat_parts(parts)
    axes = figure.add_subplot(**({} if flat else {"projection": "3d"}))
    for part in parts:
        _draw(axes, part.points, part.edges, "#9a9a9a", flat=flat, width=1.6)
    _frame(axes, parts, flat=flat)
    return axes, flat


def _frame(axes: Any, parts: Sequence[DrawnPart], *, flat: bool) -> None:
    """Equal scales, with room for what moves."""
    points = np.concatenate([part.points for part in parts])
    room = 0.2 * extent(parts)
    low, high = points.min(axis=0) - room, points.max(axis=0) + room
    axes.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), xlabel="x, m", ylabel="y, m")
    if flat:
        axes.set_aspect("equal")
    else:
        axes.set(zlim=(low[2], high[2]), zlabel="z, m")
        axes.set_box_aspect(high - low)
