"""What a live view is told before the run begins."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from recordings.run import Channel
from twin.procedures import Procedure


@dataclass(frozen=True, kw_only=True)
class LiveAbout:
    """What is known of a run before it begins."""

    title: str
    channels: tuple[Channel, ...]
    """All that will be recorded."""
    procedure: Procedure | None = None
    """None where channels are recorded without one."""
    branches: tuple[Mapping[str, Any], ...] = ()
    """Predicted curves, as in a rehearsal's ``result.json``."""
    window_s: float = 10.0
    """How much of the time signals is in sight, s."""
