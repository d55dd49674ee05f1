"""What a benchmark gives back, and how it takes its time."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


class MissingRivalError(Exception):
    """What a benchmark compares with is not installed."""


@dataclass(frozen=True, kw_only=True)
class Measured:
    """How much faster, than what, and at which error.

    Attributes
    ----------
    ratio
        Of the other's time to ours.
    promise
        What the ratio should reach at least; None where nothing is promised.
    against
        The other.
    error
        Relative difference of our result from the other's, or from the truth where `against` is not exact.
    threads
        That both sides use.
    more
        Further figures by name, with their units.
    """

    ratio: float
    promise: float | None
    against: str
    error: float
    threads: int = 1
    more: Mapping[str, float | str] = field(default_factory=dict)

    def table(self) -> dict[str, Any]:
        """All figures as one flat table."""
        found = {name: getattr(self, name) for name in ("ratio", "promise", "against", "error", "threads")}
        return found | dict(self.more)


def least_seconds(work: Callable[[], Any], repeats: int) -> float:
    """Shortest of several runs, the first of which, with its compilation, is not counted."""
    work()
    return min(_seconds(work) for _ in range(repeats))


def timed_in_turns(
    ours: Callable[[], Any], other: Callable[[], Any], *, repeats: int = 5, ours_each: int = 5
) -> tuple[float, float]:
    """Shortest times of two works that take turns, so that a busy moment of the machine meets both.

    The first run of each, with its compilation, is not counted.  The shorter work runs `ours_each` times a turn.
    """
    ours()
    other()
    best_ours = best_other = float("inf")
    for _ in range(repeats):
        best_other = min(best_other, _seconds(other))
        best_ours = min(best_ours, min(_seconds(ours) for _ in range(ours_each)))
    return best_ours, best_other


def _seconds(work: Callable[[], Any]) -> float:
    """Of the processor, on all threads: what else runs on the machine does not count."""
    start = time.process_time()
    work()
    return time.process_time() - start
