"""A rig of one beam alone, ``kind = "beam"``: a specimen hung free or clamped, known by its natural frequencies."""

from typing import Annotated, Literal

from pydantic import Field

from recordings.toml_input import Name, Table
from twin.rigs.lap_joint import Beam
from twin.rigs.tables import Effect


class BeamRig(Table):
    """A uniform beam, what holds it, and, after a diagnosis, by what its model was extended (`effect`)."""

    kind: Literal["beam"]
    name: Name
    source: str = ""
    support: Literal["free", "clamped"] = "free"
    """Hung free, or clamped at x = 0."""
    beam: Beam
    elements: Annotated[int, Field(ge=8, le=400)] = 60
    effect: list[Effect] = Field(default=[])
    note: list[str] = Field(default=[])
