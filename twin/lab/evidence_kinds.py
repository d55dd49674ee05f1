"""Which kind of evidence files hold, and what does not go with it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from recordings import InputError
from recordings.responses import are_responses
from twin.rigs import Rig
from twin.rigs.preloads import known_preload


def no_scatter() -> InputError:
    """What is told where a scatter stands beside what is no frequency response."""
    return InputError("--frequency-scatter", "", "belongs to frequency responses alone", "leave it out")


def one_preload(preloads: Sequence[str], rig: Rig) -> str | None:
    """The preload that was asked for, if one was; InputError if several were, or the rig has it not."""
    if len(preloads) > 1:
        raise InputError(
            "--preload", "", "is given more than once", "diagnose the recordings of each preload by themselves"
        )
    return known_preload(rig, preloads[0]) if preloads else None


def are_all_responses(paths: Sequence[Path]) -> bool:
    """Whether these files hold frequency responses; InputError if only some do."""
    kinds = [path.is_file() and are_responses(path) for path in paths]
    if any(kinds) and not all(kinds):
        odd = paths[kinds.index(False)]
        raise InputError(odd, "", "stands beside frequency responses", "give one kind of evidence at a time")
    return any(kinds)
