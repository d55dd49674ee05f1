"""A rig of one beam alone, ``kind = "beam"``: a specimen hung free or clamped, known by its natural frequencies."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import tomli_w
from pydantic import BaseModel, ConfigDict, Field

from recordings.toml_input import read_toml
from twin.rigs.lap_joint import Beam
from twin.rigs.tables import Effect


class BeamRig(BaseModel):
    """A uniform beam, what holds it, and, after a diagnosis, by what its model was extended (`effect`)."""

    model_config = ConfigDict(extra="forbid", frozen=True)
    kind: Literal["beam"]
    name: Annotated[str, Field(min_length=1, max_length=64)]
    source: str = ""
    support: Literal["free", "clamped"] = "free"
    """Hung free, or clamped at x = 0."""
    beam: Beam
    elements: Annotated[int, Field(ge=8, le=400)] = 60
    effect: list[Effect] = []
    note: list[str] = []


BEAM_RIG_FILES = {path.stem: path for path in sorted((Path(__file__).parent / "beam_rigs").glob("*.toml"))}
"""The shipped beams by name."""


def is_beam_rig(name_or_path: str | Path) -> bool:
    """Whether this names a shipped beam, or a TOML file with ``kind = "beam"``."""
    if str(name_or_path) in BEAM_RIG_FILES:
        return True
    path = Path(name_or_path)
    return path.is_file() and read_toml(path, _Kind).kind == "beam"


def load_beam_rig(name_or_path: str | Path) -> BeamRig:
    """A shipped beam by name, or a beam's file.

    Raises
    ------
    InputError
        If the file cannot be read or does not describe a beam.
    """
    return read_toml(BEAM_RIG_FILES.get(str(name_or_path), Path(name_or_path)), BeamRig)


def save_beam_rig(rig: BeamRig, path: Path) -> None:
    """Write `rig` as TOML that :func:`load_beam_rig` reads back equal."""
    path.write_text(tomli_w.dumps(rig.model_dump(exclude_none=True)), encoding="utf-8")


class _Kind(BaseModel):
    """Any rig's first question; a wrong type of answer is for the full model to refuse."""

    model_config = ConfigDict(extra="ignore")
    kind: object = "lap-joint"
