"""Rig files of every kind: a structure with drive and sensors, a beam alone, one measured mode."""

from pathlib import Path

import tomli_w

from recordings.toml_input import read_toml, shipped_or_file
from twin.rigs.beam import BeamRig
from twin.rigs.modal import ModalRig
from twin.rigs.rig import Rig
from twin.rigs.store import FILES, KindOfRig, load_rig, save_rig

AnyRig = Rig | BeamRig | ModalRig

KINDS: dict[object, type[BeamRig] | type[ModalRig]] = {"beam": BeamRig, "modal": ModalRig}
"""Rigs that have no structure with drive and sensors, by the ``kind`` that their file names."""


def kind_of(name_or_path: str | Path) -> type[BeamRig] | type[ModalRig] | None:
    """Which of :data:`KINDS` a shipped rig or a TOML file is; None for a structure, and where there is no file."""
    path = FILES.get(str(name_or_path), Path(name_or_path))
    kind = read_toml(path, KindOfRig).kind if path.is_file() else None
    return KINDS.get(kind) if isinstance(kind, str) else None


def load_any_rig(name_or_path: str | Path) -> AnyRig:
    """A shipped rig by name, or a rig file, of any kind.

    InputError if there is no such rig or file, or it does not describe a rig.
    """
    path = shipped_or_file(name_or_path, FILES, "rig")
    kind = kind_of(path)
    return load_rig(name_or_path) if kind is None else read_toml(path, kind)


def save_any_rig(rig: AnyRig, path: Path) -> None:
    """Write `rig` as TOML that :func:`load_any_rig` reads back equal."""
    if isinstance(rig, Rig):
        save_rig(rig, path)
    else:
        path.write_text(tomli_w.dumps(rig.model_dump(exclude_none=True)), encoding="utf-8")
