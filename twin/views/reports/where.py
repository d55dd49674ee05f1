"""Where the named causes sit: their regions of 95 % on the structure, and the sensor that would tell more."""

import numpy as np
from matplotlib.figure import Figure

from twin.arrays import Array
from twin.diagnose.answer.result import Diagnosis, Estimate, NamedCause
from twin.identify.measured_data import MeasuredData
from twin.rigs import Place
from twin.structure import Structure, drawn_parts, point_of
from twin.views.drawing import WIDTH_IN, Drawing, legend
from twin.views.page import Picture, Section
from twin.views.rig_figure import draw_fittings, draw_rest, extent, scatter
from twin.views.style import level_colour

SAMPLES = 25
"""Points of a region along a beam."""
NEXT = "#e69f00"


def where_section(diagnosis: Diagnosis) -> Section | None:
    """A picture of the structure with the regions; nothing where no cause has a place and no sensor is proposed."""
    evidence = diagnosis.evidence
    regions = regions_of(diagnosis)
    sensor = diagnosis.next_test.sensor if diagnosis.next_test is not None else None
    if not regions and sensor is None:
        return None
    added = None if sensor is None else Place(sensor.part, sensor.at, sensor.direction)
    names = " and ".join(regions)
    told = f"Thick: where {names} may sit, with 95 %." if regions else ""
    more = "" if sensor is None else " The star is where one more accelerometer would tell the rivals apart."
    return Section(
        title="Where it is",
        pictures=[
            Picture(
                draw=lambda: where_figure(evidence, regions, added=added),
                alt=f"The rig at rest with drives and sensors, and the region of 95 % of {names or 'no cause'} marked.",
                caption=(told + more).strip(),
            )
        ],
    )


def regions_of(diagnosis: Diagnosis) -> dict[str, Array]:
    """By name, points (k, 3) of the region of every named cause that has a place, m."""
    found = {cause.cause: region(diagnosis.evidence, cause) for cause in diagnosis.causes}
    return {name: points for name, points in found.items() if len(points)}


def region(evidence: MeasuredData, cause: NamedCause) -> Array:
    """Points (k, 3) of a cause's region of 95 %, m; none of a cause that has no place on the structure."""
    structure, layout, values = evidence.model.structure, evidence.rig.layout(), cause.parameters
    part, beam, support, channel = (str(values.get(name, "")) for name in ("part", "beam", "support", "channel"))
    nodes, at, offset = values.get("nodes_95"), values.get("position_m"), values.get("offset_m")
    if isinstance(nodes, tuple):
        return np.array([point_of(structure, Place(part, float(node), (0.0, 1.0, 0.0))) for node in nodes])
    if isinstance(at, Estimate):
        length = layout.beam(part).length if part else layout.length
        along = [min(max(x, 0.0), length) for x in _interval(at)]
        places = [Place(part, x, layout.beam(part).normal) if part else layout.place(x) for x in along]
    elif isinstance(offset, Estimate) and channel:
        places = [layout.moved(evidence.rig.place_of(channel), x) for x in _interval(offset)]
    elif support:
        places = [Place(support, s.at, (0.0, 1.0, 0.0)) for s in layout.supports if s.part == support]
    elif beam:
        return next(drawn.points for drawn in drawn_parts(structure) if drawn.name == beam)
    else:
        return _joint_points(structure, cause)
    return np.array([point_of(structure, place) for place in places])


def _joint_points(structure: Structure, cause: NamedCause) -> Array:
    """Of the joint that a cause names, or of the only one where the cause is a joint's."""
    name = cause.parameters.get("joint")
    if name is None and not cause.cause.startswith("joint-") and cause.cause != "preload-loss":
        return np.zeros((0, 3))
    return np.concatenate([np.zeros((0, 3)), *(j.points for j in structure.joints if name in (None, j.name))])


def _interval(value: Estimate) -> list[float]:
    reach = 1.96 * value.std  # 95 %
    return np.linspace(value.value - reach, value.value + reach, SAMPLES).tolist()


def where_figure(evidence: MeasuredData, regions: dict[str, Array], *, added: Place | None) -> Figure:
    """The rig at rest, thick where a cause may sit."""
    structure = evidence.model.structure
    parts = drawn_parts(structure)
    figure = Drawing(figsize=(WIDTH_IN, 3.6), layout="constrained")
    axes, flat = draw_rest(figure, parts)
    for number, (name, points) in enumerate(regions.items()):
        scatter(axes, points, level_colour(number), "o", 60, flat=flat, label=name)
    draw_fittings(axes, structure, evidence.rig, size=extent(parts), flat=flat)
    if added is not None:
        scatter(axes, point_of(structure, added)[None], NEXT, "*", 160, flat=flat, label="sensor to add")
    legend(figure, columns=8)
    return figure
