"""The rig file of an import: TOML with a comment on every field that the user must check."""

import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from twin.rigs.imported.part import ImportedPart
from twin.rigs.imported.places import NodePlace
from twin.rigs.limits import LIMITS
from twin.rigs.matrix_files import NodePairs


@dataclass(frozen=True, eq=False)
class FoundJoint:
    """Two parts whose nodes face each other."""

    name: str
    a: ImportedPart
    b: ImportedPart
    pairs: NodePairs

    @property
    def height_m(self) -> float:
        """Mean distance of facing nodes, or a chosen height where they coincide."""
        a, b = (
            np.array([part.matrices.coordinates_of(int(node)) for node in nodes])
            for part, nodes in ((self.a, self.pairs.a), (self.b, self.pairs.b))
        )
        gap = float(np.linalg.norm(b - a, axis=1).mean())
        return gap if gap > LIMITS.coincident_height_m / 10 else LIMITS.coincident_height_m


@dataclass(frozen=True, eq=False)
class RigContents:
    """All that the file says."""

    name: str
    parts: Sequence[ImportedPart]
    joints: Sequence[FoundJoint]
    supports: Sequence[tuple[NodePlace, tuple[str, ...]]]
    drive: tuple[NodePlace, str]
    drive_chosen: bool
    sensors: Sequence[tuple[str, NodePlace, str]]
    modes_to_Hz: float
    files: dict[tuple[str, str], str]
    """Of each part its mass, stiffness and nodes, of each joint its pairs, by (name, kind)."""


def rig_text(rig: RigContents) -> str:
    """The file."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("twin.rigs.imported", ""),
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters.update(quoted=partial(json.dumps, ensure_ascii=False), plain=_plain)
    return environment.get_template("rig.toml.jinja").render(rig=rig)


def _plain(text: str) -> str:
    """A text that cannot end its comment."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
