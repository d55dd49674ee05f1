"""The studies by name, imported when they are asked for."""

from __future__ import annotations

import importlib

from twin.papers.reproduction import Reproduction

__all__ = ["STUDY_NAMES", "reproduce"]

STUDY_NAMES = ("steel-lap-joint", "composite-beam", "hybrid-joint")


def reproduce(name: str) -> Reproduction:
    """Recompute one study, see :data:`STUDY_NAMES`.

    Raises
    ------
    KeyError
        If there is no such study.
    """
    if name not in STUDY_NAMES:
        raise KeyError(name)
    module = importlib.import_module(f"twin.papers.{name.replace('-', '_')}")
    result = getattr(module, f"reproduce_{name.replace('-', '_')}")()
    assert isinstance(result, Reproduction)
    return result
