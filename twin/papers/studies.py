"""The studies by name, imported when they are asked for."""

from __future__ import annotations

from twin.papers.reproduction import Reproduction

__all__ = ["STUDY_NAMES", "reproduce"]

STUDY_NAMES = ("steel-lap-joint",)


def reproduce(name: str) -> Reproduction:
    """Recompute one study, see :data:`STUDY_NAMES`.

    Raises
    ------
    KeyError
        If there is no such study.
    """
    if name == "steel-lap-joint":
        from twin.papers.steel_lap_joint import reproduce_steel_lap_joint

        return reproduce_steel_lap_joint()
    raise KeyError(name)
