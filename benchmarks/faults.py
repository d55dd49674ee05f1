"""Every fault of instruments, wires and files, tried, and what became of it over all tries."""

import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from benchmarks.fault_trials import CASES, Outcome, try_fault
from benchmarks.file_trials import try_full_disk, try_kill, try_read_only


@dataclass(frozen=True, kw_only=True)
class Row:
    """One fault over all tries; samples are those of all channels."""

    fault: str
    happened: int
    tried: int
    noticed: int
    stored: int
    lost: int
    most_lost: int
    silently_wrong: int

    @property
    def as_it_should_be(self) -> bool:
        """Whether it was noticed each time (or never, where nothing was wrong), and no number is silently wrong."""
        return self.noticed == (self.tried if self.happened else 0) and self.silently_wrong == 0


def every_trial(
    acquire: Callable[[Sequence[str]], Mapping[str, Any]],
) -> list[tuple[str, Callable[..., Outcome]]]:
    """All there is to try, by name; `acquire` runs ``twin acquire`` with these arguments and gives what it tells."""
    trials: list[tuple[str, Callable[..., Outcome]]] = [
        (case.name, partial(try_fault, case, acquire=acquire)) for case in CASES
    ]
    program = [sys.executable, "-m", "twin", "acquire"]
    for name, attempt in (
        ("acquire killed (kill -9)", try_kill), ("disk full", try_full_disk), ("folder read-only", try_read_only)
    ):  # fmt: skip
        trials.append((name, partial(attempt, program=program)))
    return trials


def count(name: str, outcomes: Sequence[Outcome]) -> Row:
    """One fault over all its tries."""
    return Row(
        fault=name, tried=len(outcomes),
        happened=sum(each.happened for each in outcomes), noticed=sum(each.noticed for each in outcomes),
        stored=sum(each.stored for each in outcomes), lost=sum(each.lost for each in outcomes),
        most_lost=max(each.lost for each in outcomes),
        silently_wrong=sum(each.silently_wrong for each in outcomes),
    )  # fmt: skip


def markdown(rows: Sequence[Row]) -> str:
    """As Markdown: it reads well on a terminal and goes into a document."""
    lines = [
        "| fault | happened | recordings | noticed in | stored | lost and told | most in one | silently wrong |",
        "| --- | --: | --: | --: | --: | --: | --: | --: |",
    ]
    for row in rows:
        lines.append(
            f"| {row.fault} | {row.happened} | {row.tried} | {row.noticed} | {row.stored} | {row.lost} "
            f"| {row.most_lost} | {row.silently_wrong} |"
        )
    return "\n".join(lines)
