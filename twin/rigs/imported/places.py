"""Places for a drive, sensors and supports: by node number or by the nearest node."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from recordings.directions import AXES
from recordings.errors import InputError
from twin.rigs.imported.part import ImportedPart
from twin.rigs.layout import DOFS


@dataclass(frozen=True)
class NodePlace:
    """A node of a part, and how far from where it was asked for."""

    part: ImportedPart
    node: int
    away_m: float = 0.0

    @property
    def dofs(self) -> tuple[str, ...]:
        """What it can do."""
        return tuple(dof for dof in DOFS if (self.node, dof) in self.part.matrices.rows)

    @property
    def told(self) -> str:
        """Part, node and coordinates."""
        x, y, z = self.part.matrices.coordinates_of(self.node)
        return f"{self.part.name}, node {self.node} at {x:.6g}, {y:.6g}, {z:.6g} m"


def find_place(parts: Sequence[ImportedPart], text: str, option: str) -> NodePlace:
    """The place that is meant by ``x,y,z`` in metres, ``NODE`` or ``PART/NODE``.

    InputError if it is none of these, or there is no such node.
    """
    name, slash, rest = text.strip().rpartition("/")
    chosen = [part for part in parts if part.name == name] if slash else list(parts)
    words = rest.split(",")
    try:
        numbers = [float(word) for word in words]
    except ValueError:
        numbers = []
    if not chosen or len(numbers) not in (1, 3) or not np.all(np.isfinite(numbers)):
        listed = ", ".join(part.name for part in parts)
        raise InputError(
            option, "", f"{text[:60]!r} is no place on {listed}", "give x,y,z in metres, or a node's number"
        )
    if len(numbers) == 1:
        for part in chosen:
            if numbers[0] in part.matrices.nodes:
                return NodePlace(part, int(numbers[0]))
        raise InputError(option, "", f"no node {rest[:30]} that moves", "take one of the table's")
    place = np.array(numbers)
    away = [np.linalg.norm(part.matrices.coordinates - place, axis=1) for part in chosen]
    best = int(np.argmin([distances.min() for distances in away]))
    at = int(np.argmin(away[best]))
    return NodePlace(chosen[best], int(chosen[best].matrices.nodes[at]), float(away[best][at]))


def place_and_direction(parts: Sequence[ImportedPart], text: str, option: str) -> tuple[NodePlace, str]:
    """A place with a direction behind a colon, along which its node moves; InputError if it does not."""
    where, _, direction = text.rpartition(":")
    if direction[:1] not in ("+", "-") or direction[1:] not in AXES:
        raise InputError(option, "", f"{text[:60]!r} ends in no direction", "write PLACE:+x, PLACE:-z, ...")
    place = find_place(parts, where, option)
    if direction[1:] not in place.dofs:
        reason = f"{place.told} has no displacement along {direction[1:]}"
        raise InputError(option, "", reason, f"it has {', '.join(place.dofs)}")
    return place, direction


def support_at(parts: Sequence[ImportedPart], text: str, option: str) -> tuple[NodePlace, tuple[str, ...]]:
    """A place and what is held there: all that its node can do, or what stands behind a colon."""
    where, colon, held = text.partition(":")
    place = find_place(parts, where, option)
    dofs = tuple(word.strip() for word in held.split(",")) if colon else place.dofs
    if unknown := [dof for dof in dofs if dof not in place.dofs]:
        reason = f"{place.told} has no {unknown[0][:10]!r} to hold"
        raise InputError(option, "", reason, f"it has {', '.join(place.dofs)}")
    return place, dofs


def usual_drive(parts: Sequence[ImportedPart], held: Iterable[NodePlace]) -> tuple[NodePlace, str]:
    """Where and along what a structure is soft: the displacement of least own stiffness, a corner of most meshes."""
    taken = {(place.part.name, place.node) for place in held}
    choices = []
    for part in parts:
        own = part.matrices.K.diagonal()
        choices += [
            (float(own[row]), part, node, dof)
            for (node, dof), row in part.matrices.rows.items()
            if dof in AXES and (part.name, node) not in taken
        ]
    if not choices:
        raise InputError("--drive", "", "no node moves that could be driven", "give other matrices or fewer supports")
    _, part, node, dof = min(choices, key=lambda choice: choice[0])
    return NodePlace(part, node), f"+{dof}"
