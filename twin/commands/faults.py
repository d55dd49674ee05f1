"""`twin faults`: every fault tried many times, and how often it was noticed, what it cost, what was silently wrong."""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import click

from recordings.beside import temporary_folder
from recordings.errors import InputError
from twin.commands.output import json_option, print_json, progress_bar, say, stage

if TYPE_CHECKING:
    from drivers.fault_trials import Outcome


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


@click.command(name="faults")
@click.option("--tries", type=click.IntRange(1), default=5, show_default=True, help="Of each fault.")
@click.option("--only", metavar="WORDS", help="Faults with these words in their name.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the first try.")
@json_option
def command(tries: int, only: str | None, seed: int, as_json: bool) -> int:
    """Try every fault on virtual instruments, and count what became of it in the recording.

    A tone whose samples can be computed again is served over TCP and CAN and acquired as a user would; each stored
    sample is compared with the one that was sent, and its time with the time it was taken at.  Recordings are also
    killed, filled up and locked out.  Exit status 1 if a fault went unnoticed or a number is silently wrong.
    """
    every = list(_trials())
    trials = [(name, attempt) for name, attempt in every if not only or only in name]
    if not trials:
        known = ", ".join(name for name, _ in every)
        raise InputError("--only", "", f"no fault has {only!r} in its name", f"there are {known}")
    rows = []
    with progress_bar() as bar:
        task = bar.add_task("", total=tries * len(trials))
        for name, attempt in trials:
            bar.update(task, description=name)
            stage(f"trying {name}")
            outcomes = []
            for number in range(tries):
                outcomes.append(_in_a_folder(attempt, seed + number))
                bar.advance(task)
            rows.append(_count(name, outcomes))
    good = all(row.as_it_should_be for row in rows)
    if as_json:
        print_json({"faults": [asdict(row) for row in rows], "silently_wrong": sum(row.silently_wrong for row in rows)})
    _print_table(rows)
    return 0 if good else 1


def _trials() -> Iterator[tuple[str, Callable[..., Outcome]]]:
    """All there is to try, by name."""
    from drivers.fault_trials import CASES, try_fault
    from drivers.file_trials import try_full_disk, try_kill, try_read_only

    for case in CASES:
        yield case.name, partial(try_fault, case, acquire=_acquired)
    program = [sys.executable, "-m", "twin", "acquire"]
    for name, attempt in (
        ("acquire killed (kill -9)", try_kill), ("disk full", try_full_disk), ("folder read-only", try_read_only)
    ):  # fmt: skip
        yield name, partial(attempt, program=program)


def _acquired(arguments: Sequence[str]) -> dict[str, Any]:
    """Run `twin acquire` in this process, silently; gives what it tells."""
    from twin.commands.acquire import command as acquire

    answer = io.StringIO()
    with redirect_stdout(answer), redirect_stderr(io.StringIO()):
        acquire.main([*arguments, "--json"], standalone_mode=False)
    told: dict[str, Any] = json.loads(answer.getvalue())
    return told


def _in_a_folder(attempt: Callable[..., Outcome], seed: int) -> Outcome:
    with temporary_folder("twin-faults") as folder:
        return attempt(folder, seed=seed)


def _count(name: str, outcomes: list[Outcome]) -> Row:
    return Row(
        fault=name, tried=len(outcomes),
        happened=sum(each.happened for each in outcomes), noticed=sum(each.noticed for each in outcomes),
        stored=sum(each.stored for each in outcomes), lost=sum(each.lost for each in outcomes),
        most_lost=max(each.lost for each in outcomes),
        silently_wrong=sum(each.silently_wrong for each in outcomes),
    )  # fmt: skip


def _print_table(rows: list[Row]) -> None:
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
    say("\n".join(lines))
