"""The causes a diagnosis may name, by name."""

from collections.abc import MutableMapping
from typing import Any

from twin.cause_registry import Registered, from_folders
from twin.diagnose.cause import Cause


def _model(module: Any, name: str) -> Cause:
    """The class named as the folder, in capitals."""
    cause = getattr(module, "".join(word.capitalize() for word in name.split("-")))()
    assert isinstance(cause, Cause)
    return cause


CAUSES: MutableMapping[str, Cause] = Registered("model", from_folders("model", _model))
"""All that have a forward model."""

DRIFTS = ("preload-loss", "temperature-drift")
"""Causes whose rate is per second of the rig's time, which a recording without its waits does not have."""
