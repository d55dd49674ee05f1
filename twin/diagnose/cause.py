"""What every cause says of itself: its parameters, what it adds to the forward model, and in words."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.unknowns import Unknowns
from twin.rigs import BeamPart, Place, unit_vector
from twin.structure import NodeField, Structure

__all__ = [
    "Cause",
    "Parameter",
    "Values",
    "all_channels",
    "along_beam",
    "beam_labels",
    "from_told_place",
    "joint_labels",
    "joint_name",
    "joint_number",
    "main_strength",
    "measured_duration_s",
    "node_field",
    "part_labels",
    "place_at",
    "place_labels",
    "point",
    "position",
    "response_channels",
    "searched_length",
    "single_point",
    "told_place",
]

Array = NDArray[Any]
Values = Mapping[str, float]

REGION = 0.95
"""Probability of the region of nodes that is reported with a place."""


@dataclass(frozen=True, kw_only=True)
class Parameter:
    """A parameter of a cause, in SI units.

    Attributes
    ----------
    name : str
        As the recording contract fixes it.
    scale : float
        Standard deviation of its prior: how large such a fault usually is, around `null`.
    lower, upper : float
        Bounds.
    null : float
        Value at which the cause has no effect; NaN for a parameter that places an effect and has none.
    starts : tuple of float
        Where a search begins, the likeliest first.
    negligible : float
        Share of the scale below which a strength is no cause, however clearly a long record shows it: the finite
        elements and the modal damping of the model are themselves no better.
    model_error : float
        Relative error of what is found, beyond what noise makes: of the distance from `null`, or of the value itself
        where that places an effect.  The model's mesh and modes, and for some causes its simplifications; as large as
        blind cases on the finer bench showed it to be.
    """

    name: str
    scale: float
    lower: float
    upper: float
    null: float = float("nan")
    starts: tuple[float, ...] = ()
    negligible: float = 0.02
    model_error: float = 0.0

    def spread(self, value: float, std: float) -> float:
        """Standard deviation of what was found, from that of a fit."""
        size = value if self.places else value - self.null
        return float(np.hypot(std, self.model_error * size))

    @property
    def places(self) -> bool:
        """Whether the parameter only says where or at which frequency an effect is."""
        return bool(np.isnan(self.null))

    @property
    def prior(self) -> tuple[float, float]:
        """Mean and precision in units of the scale: one that places an effect has the variance of an even spread."""
        if not self.places:
            return self.null / self.scale, 1.0
        width = (self.upper - self.lower) / self.scale
        return (self.lower + self.upper) / 2 / self.scale, 12.0 / width**2


class Cause(ABC):
    """One way in which the rig may differ from what is believed.

    A cause is one file in ``twin/diagnose/causes``: its name and parameters, fixed by the recording contract, an
    :class:`~twin.identify.extension.Extension` of the forward model, and a sentence.
    """

    name: ClassVar[str]
    summary: ClassVar[str]
    tried_at_full_size: ClassVar[bool] = False
    """Whether a search fits it from its usual size even where its first order at nothing promises no gain: an effect
    that the base family's own law imitates leaves no slope there."""

    def labels(self, evidence: Evidence) -> Sequence[Mapping[str, str]]:
        """Choices that are names, such as the channel at fault: one search each; a single empty one by default."""
        return ({},)

    def assumed(self, evidence: Evidence) -> Mapping[str, str]:
        """Names that a rig file may leave out, and what is meant then; none by default."""
        return {}

    @abstractmethod
    def parameters(self, evidence: Evidence, label: Mapping[str, str]) -> tuple[Parameter, ...]:
        """The numbers to be found; the first one with a null value is the effect's strength."""

    def reported(self, values: Values, std: Values) -> tuple[dict[str, float], dict[str, float]]:
        """Values and standard deviations under the contract's names, where a search wants others."""
        return dict(values), dict(std)

    def from_reported(self, values: Values) -> dict[str, float]:
        """Return the inverse of :meth:`reported`, with what is not reported at its likeliest."""
        return dict(values)

    def shared(
        self, evidence: Evidence, label: Mapping[str, str], unknowns: Unknowns, values: Values
    ) -> tuple[Unknowns, dict[str, float]]:
        """Where a fit begins: what the data only know of the base family and the cause together, shared by the priors.

        A fit need not creep along a line on which nothing changes; by default nothing is shared.
        """
        return unknowns, dict(values)

    @abstractmethod
    def extension(self, evidence: Evidence, label: Mapping[str, str], values: Values) -> Extension:
        """What differs from the believed rig at these values."""


def main_strength(parameters: Sequence[Parameter]) -> Parameter | None:
    """The first parameter that has a null value; None where an effect has no strength."""
    return next((p for p in parameters if not p.places), None)


def measured_duration_s(evidence: Evidence) -> float:
    """From the first step of all runs to the last that is used; at least ten seconds, a scale for what drifts."""
    times = [*evidence.steps.time_s, *(data.time_s for data in evidence.broadband)]
    return max(float(max(times)) - evidence.origin_s if times else 0.0, 10.0)


def joint_labels(evidence: Evidence) -> Sequence[Mapping[str, str]]:
    """Which joint: a single search where there is one, without a name."""
    joints = evidence.rig.joints
    return ({},) if len(joints) == 1 else tuple({"joint": joint.name} for joint in joints)


def joint_number(evidence: Evidence, label: Mapping[str, str]) -> int:
    """Of the joint that a label names, in the rig's order."""
    return [joint.name for joint in evidence.rig.joints].index(joint_name(evidence, label))


def joint_name(evidence: Evidence, label: Mapping[str, str]) -> str:
    """The joint that a label names, or the only one."""
    return label.get("joint") or evidence.rig.joints[0].name


def place_labels(evidence: Evidence) -> Sequence[Mapping[str, str]]:
    """Where a place is searched: along the whole structure where one beam leads to the next, else on each part.

    On a part given by matrices that is thin in no direction a push may go along any axis, one search each.
    """
    layout = evidence.rig.layout()
    if layout.passable:
        return ({},)
    found: list[Mapping[str, str]] = []
    for part in layout.parts:
        if isinstance(part, BeamPart):
            found.append({"part": part.name})
        else:
            across = evidence.model.structure.node_field(part.name).across
            found += [{"part": part.name, **({"direction": _told(d)} if len(across) > 1 else {})} for d in across]
    return tuple(found)


def part_labels(evidence: Evidence) -> Sequence[Mapping[str, str]]:
    """The same for what has no direction: one search a part."""
    layout = evidence.rig.layout()
    return ({},) if layout.passable else tuple({"part": part.name} for part in layout.parts)


def beam_labels(evidence: Evidence) -> Sequence[Mapping[str, str]]:
    """The same for what only a beam can have."""
    layout = evidence.rig.layout()
    return ({},) if layout.passable else tuple({"part": beam.name} for beam in layout.beams)


def searched_length(evidence: Evidence, label: Mapping[str, str]) -> float:
    """Metres along which a place on beams is searched."""
    layout = evidence.rig.layout()
    return layout.beam(label["part"]).length if "part" in label else layout.length


def node_field(evidence: Evidence, label: Mapping[str, str]) -> NodeField | None:
    """The nodes among which a place is searched; None where that goes along beams."""
    if "part" not in label or isinstance(evidence.rig.layout().part(label["part"]), BeamPart):
        return None
    return evidence.model.structure.node_field(label["part"])


def along_beam(evidence: Evidence, label: Mapping[str, str], count: int = 14) -> tuple[float, ...]:
    """Positions to begin a search from, m: evenly along the structure or a beam, its end first, its start left out."""
    length = searched_length(evidence, label)
    return tuple(float(x) for x in np.linspace(length, length / count, count))


def position(
    evidence: Evidence, label: Mapping[str, str], count: int = 14, *, model_error: float = 2e-3
) -> tuple[Parameter, ...]:
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
        return (
            Parameter(
                name="position_m", scale=length, lower=0.01 * length, upper=length, starts=starts,
                model_error=model_error,
            ),
        )  # fmt: skip
    found = []
    for number, extent in enumerate(map(float, field.extent), 1):
        here = max(round(count**0.5 * extent / float(np.exp(np.mean(np.log(field.extent))))), 2)
        starts = tuple(float(extent * (k + 0.5) / here) for k in range(here))
        found.append(
            Parameter(
                name=f"position_{number}_m", scale=extent, lower=0.0, upper=extent, starts=starts,
                model_error=model_error,
            )
        )  # fmt: skip
    return tuple(found)


def place_at(evidence: Evidence, label: Mapping[str, str], values: Values) -> Place:
    """The place that a label and its position name: across its beam, or in the label's direction."""
    layout, field = evidence.rig.layout(), node_field(evidence, label)
    if field is not None:
        at = _coordinates(field, values)
        direction = unit_vector(label["direction"]) if "direction" in label else field.across[0]
        return Place(label["part"], float(field.nearest(at)), direction, field.weights(at))
    if "part" not in label:
        return layout.place(values["position_m"])
    beam = layout.beam(label["part"])
    return Place(beam.name, min(max(values["position_m"], 0.0), beam.length), (*beam.normal, 0.0))


def _coordinates(field: NodeField, values: Values) -> Array:
    return np.array([values[f"position_{number}_m"] for number in range(1, len(field.extent) + 1)])


def _told(direction: tuple[float, float, float]) -> str:
    """A unit vector along an axis as a rig file has it, such as ``+z``."""
    axis = int(np.argmax(np.abs(direction)))
    return f"{'+' if direction[axis] > 0 else '-'}{'xyz'[axis]}"


def told_place(
    evidence: Evidence, label: Mapping[str, str], values: Values, std: Values
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
    nodes = field.within(at, spread, float(chi2.ppf(REGION, len(names))))
    return rest | {"node": float(field.nearest(at))}, errors | {"node": 0.0}, nodes


def from_told_place(evidence: Evidence, label: Mapping[str, str], values: Values) -> dict[str, float]:
    """Return the inverse of :func:`told_place`.

    Raises
    ------
    ValueError
        If the part has no such node.
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


def single_point(place: Place) -> Callable[[Structure], Array]:
    """The same (n,), for a nonlinear force."""
    return lambda s: s.row(place)


def response_channels(evidence: Evidence) -> tuple[dict[str, str], ...]:
    """One label for each response channel."""
    return tuple({"channel": name} for name in evidence.channels)


def all_channels(evidence: Evidence) -> tuple[dict[str, str], ...]:
    """One label for each channel, the force's last."""
    return (*response_channels(evidence), {"channel": evidence.force})
