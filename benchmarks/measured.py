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


def timed_in_turns(*works: Callable[[], Any], tries: int = 7, least_s: float = 0.02) -> list[float]:
    """Seconds of each work: the shortest of as many tries for all, taken in turns, so that a busy moment meets each.

    A try repeats its work until it has lasted `least_s`.  A first run of each, with its compilation, is not counted.
    """
    repeats = []
    for work in works:
        work()
        repeats.append(1 + int(least_s / max(_seconds(work), 1e-9)))
    found = [[_seconds(work, repeat) for work, repeat in zip(works, repeats, strict=True)] for _ in range(tries)]
    return [min(of_work) for of_work in zip(*found, strict=True)]


def _seconds(work: Callable[[], Any], repeats: int = 1) -> float:
    """Of the processor, on all threads, for one of several runs: what else runs on the machine does not count."""
    start = time.process_time()
    for _ in range(repeats):
        work()
    return (time.process_time() - start) / repeats
