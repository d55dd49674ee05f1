"""Where a cause sits: places searched along beams and among the nodes of parts given by matrices."""

from collections.abc import Callable, Mapping, Sequence

import numpy as np
from scipy.stats import chi2

from recordings.directions import direction_name, unit_vector
from twin.arrays import Array
from twin.diagnose.cause import Parameter, Values
from twin.diagnose.limits import LIMITS
from twin.identify.measured_data import MeasuredData, drive_places
from twin.identify.model_modification import Attachment
from twin.rigs import BeamPart, Place
from twin.structure import NodeField, Structure


def place_labels(evidence: MeasuredData) -> Sequence[Mapping[str, str]]:
    """Where a place is searched: along the whole structure where one beam leads to the next, else on each part.

    On a beam in space a push may go along thickness and width, and on a part given by matrices that is thin in no
    direction along any axis, one search each.
    """
    layout = evidence.rig.layout()
    if layout.passable:
        return ({},)
    found: list[Mapping[str, str]] = []
    for part in layout.parts:
        if isinstance(part, BeamPart):
            across = part.ways_across
        else:
            across = evidence.model.structure.node_field(part.name).across
        found += [{"part": part.name, **({"direction": direction_name(d)} if len(across) > 1 else {})} for d in across]
    return tuple(found)


def part_labels(evidence: MeasuredData) -> Sequence[Mapping[str, str]]:
    """The same for what has no direction: one search a part."""
    layout = evidence.rig.layout()
    return ({},) if layout.passable else tuple({"part": part.name} for part in layout.parts)


def beam_labels(evidence: MeasuredData) -> Sequence[Mapping[str, str]]:
    """The same for what only a beam can have."""
    layout = evidence.rig.layout()
    return ({},) if layout.passable else tuple({"part": beam.name} for beam in layout.beams)


def searched_length(evidence: MeasuredData, label: Mapping[str, str]) -> float:
    """Metres along which a place on beams is searched."""
    layout = evidence.rig.layout()
    return layout.beam(label["part"]).length if "part" in label else layout.length


def node_field(evidence: MeasuredData, label: Mapping[str, str]) -> NodeField | None:
    """The nodes among which a place is searched; None where that goes along beams."""
    if "part" not in label or isinstance(evidence.rig.layout().part(label["part"]), BeamPart):
        return None
    return evidence.model.structure.node_field(label["part"])


def along_beam(evidence: MeasuredData, label: Mapping[str, str], count: int = 14) -> tuple[float, ...]:
    """Positions to begin a search from, m: evenly along the structure or a beam, its end first, its start left out."""
    length = searched_length(evidence, label)
    return tuple(float(x) for x in np.linspace(length, length / count, count))


def position(evidence: MeasuredData, label: Mapping[str, str], count: int = 14) -> tuple[Parameter, ...]:
    """Parameters of a place: `position_m` along the whole structure or a beam, else one for each way across a part.

    Parameters
    ----------
    count
        Positions along a beam to begin a search from.
    """
    field = node_field(evidence, label)
    if field is None:
        length = searched_length(evidence, label)
        starts = along_beam(evidence, label, count)
        return (Parameter(name="position_m", scale=length, lower=0.01 * length, upper=length, starts=starts),)
    found = []
    for number, extent in enumerate(map(float, field.extent), 1):
        here = max(round(count**0.5 * extent / float(np.exp(np.mean(np.log(field.extent))))), 2)
        starts = tuple(float(extent * (k + 0.5) / here) for k in range(here))
        found.append(Parameter(name=f"position_{number}_m", scale=extent, lower=0.0, upper=extent, starts=starts))
    return tuple(found)


def place_at(evidence: MeasuredData, label: Mapping[str, str], values: Values) -> Place:
    """The place that a label and its position name: across its beam, or in the label's direction."""
    layout, field = evidence.rig.layout(), node_field(evidence, label)
    told = unit_vector(label["direction"]) if "direction" in label else None
    if field is not None:
        at = _coordinates(field, values)
        return Place(label["part"], float(field.nearest(at)), told or field.across[0], field.weights(at))
    if "part" not in label:
        return layout.place(values["position_m"])
    beam = layout.beam(label["part"])
    return Place(beam.name, min(max(values["position_m"], 0.0), beam.length), told or beam.normal)


def _coordinates(field: NodeField, values: Values) -> Array:
    return np.array([values[f"position_{number}_m"] for number in range(1, len(field.extent) + 1)])


def told_place(
    evidence: MeasuredData, label: Mapping[str, str], values: Values, std: Values
) -> tuple[dict[str, float], dict[str, float], tuple[int, ...]]:
    """Values and deviations with a node in place of a position between nodes, and the nodes of its 95 % region."""
    field = node_field(evidence, label)
    if field is None:
        return dict(values), dict(std), ()
    names = [f"position_{number}_m" for number in range(1, len(field.extent) + 1)]
    if not set(names) <= set(values):
        return dict(values), dict(std), ()
    at, spread = _coordinates(field, values), np.array([std.get(name, 0.0) for name in names])
    rest = {name: value for name, value in values.items() if name not in names}
    errors = {name: value for name, value in std.items() if name not in names}
    nodes = field.within(at, spread, float(chi2.ppf(LIMITS.places_region, len(names))))
    return rest | {"node": float(field.nearest(at))}, errors | {"node": 0.0}, nodes


def from_told_place(evidence: MeasuredData, label: Mapping[str, str], values: Values) -> dict[str, float]:
    """Return the inverse of :func:`told_place`.

    ValueError if the part has no such node.
    """
    field = node_field(evidence, label)
    if field is None or "node" not in values:
        return dict(values)
    at = field.position(int(values["node"]))
    rest = {name: value for name, value in values.items() if name != "node"}
    return rest | {f"position_{number}_m": float(x) for number, x in enumerate(at, 1)}


def point(place: Place) -> Callable[[Structure], Array]:
    """One port at a place in its direction, (1, n), for an attachment."""
    return lambda s: s.row(place)[None]


def brought_along(evidence: MeasuredData, stiffness: Callable[[Array], Array]) -> tuple[Attachment, ...]:
    """A dynamic stiffness (f, 1) that a shaker brings along, at the place of whichever drive acts."""
    places = drive_places(evidence)
    if len(places) == 1:
        return (Attachment(point(places[0]), stiffness),)
    return tuple(Attachment(point(place), stiffness, drive=number) for number, place in enumerate(places))


def single_point(place: Place) -> Callable[[Structure], Array]:
    """The same (n,), for a nonlinear force."""
    return lambda s: s.row(place)
