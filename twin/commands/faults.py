"""`twin faults`: every fault tried many times, and how often it was noticed, what it cost, what was silently wrong."""

import io
import json
from collections.abc import Sequence
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import asdict
from typing import Any

import click

from recordings.beside import temporary_folder
from recordings.errors import InputError
from twin.commands.common.options import json_option
from twin.commands.common.output import print_json, progress_bar, say, stage


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
    from benchmarks.faults import count, every_trial, markdown

    every = every_trial(_acquired)
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
                with temporary_folder("twin-faults") as folder:
                    outcomes.append(attempt(folder, seed=seed + number))
                bar.advance(task)
            rows.append(count(name, outcomes))
    good = all(row.as_it_should_be for row in rows)
    if as_json:
        print_json({"faults": [asdict(row) for row in rows], "silently_wrong": sum(row.silently_wrong for row in rows)})
    say(markdown(rows))
    return 0 if good else 1


def _acquired(arguments: Sequence[str]) -> dict[str, Any]:
    """Run `twin acquire` in this process, silently; gives what it tells."""
    from twin.commands.acquire import command as acquire

    answer = io.StringIO()
    with redirect_stdout(answer), redirect_stderr(io.StringIO()):
        acquire.main([*arguments, "--json"], standalone_mode=False)
    told: dict[str, Any] = json.loads(answer.getvalue())
    if told["state"] == "interrupted":  # meant for the trials as well
        raise KeyboardInterrupt
    return told
