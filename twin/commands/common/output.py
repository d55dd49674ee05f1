"""How commands speak: one JSON object on standard output when asked, everything else on standard error."""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import rich.box
import rich.table
from pydantic_core import to_jsonable_python
from rich.console import Console
from rich.progress import (
    BarColumn,
    Progress,
    Task,
    TaskProgressColumn,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from recordings.errors import printable
from recordings.whole import whole_file

if TYPE_CHECKING:
    from twin.views.table import Table

console = Console(stderr=True, highlight=False, markup=False)
"""Progress, warnings and tables for people.  No markup: names from a stranger's file have brackets as they like."""

SAID_AFTER_s = 0.9
"""A stage that is over sooner gets no line where no bar is shown: who gave a bad file reads of that alone."""

_verbose = False


def set_verbose(wanted: bool) -> None:
    """Say what is done and when, and where an error came from."""
    global _verbose
    _verbose = wanted


def trace() -> None:
    """Where the error that is being handled came from, for who asked with --verbose."""
    if _verbose:
        console.print_exception()


def plain(value: Any) -> Any:
    """`value` with numpy scalars, arrays and paths turned into what JSON knows; NaN and infinity become null."""
    return to_jsonable_python(value, inf_nan_mode="null", fallback=lambda of_numpy: of_numpy.tolist())


def print_json(result: Mapping[str, Any]) -> None:
    """Write one JSON object to standard output."""
    click.echo(json.dumps(plain(result), indent=2, allow_nan=False))


def write_json(result: Mapping[str, Any], path: Path) -> None:
    """Write one JSON object to a file, whole or not at all."""
    with whole_file(path) as part:
        part.write_text(json.dumps(plain(result), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def say(*pieces: str | tuple[str, str]) -> None:
    """Print for people, on standard error.

    Parameters
    ----------
    pieces
        Of the text; one with a style is a tuple of both, such as ``("done", "green")``.
    """
    parts = [(piece, "") if isinstance(piece, str) else piece for piece in pieces]
    console.print(Text.assemble(*((printable(text), style) for text, style in parts)), soft_wrap=True)


def tell_assumed(lines: Sequence[str]) -> None:
    """Say what stands for what a rig file leaves out."""
    if lines:
        say(("assumed", "cyan"), f": {'; '.join(lines)}")


def print_tables(*tables: Table, to: Console | None = None) -> None:
    """Print tables: on standard output if they are a command's answer, or on `to`."""
    out = to or Console(highlight=False, markup=False)
    for table in tables:
        drawn = rich.table.Table(title=table.caption, title_justify="left", box=rich.box.SIMPLE, padding=(0, 1, 0, 0))
        for place, heading in enumerate(table.head):
            drawn.add_column(heading, justify="right" if place in table.numbers else "left", overflow="fold")
        for row in table.rows:
            drawn.add_row(*row)
        out.print(drawn)


def typed() -> str:
    """The command line as it was typed, for a report that says how to get it again."""
    return str(click.get_current_context().obj)


def next_step(text: str) -> None:
    """Say what a user would do next, as the last line of a command."""
    say(f"next: {text}")


def stage(text: str) -> None:
    """Say what begins now where no bar shows it: standard error is no terminal, or ``--verbose`` was asked for."""
    if _verbose or not console.is_terminal:
        say(text)


def progress_bar() -> Progress:
    """A bar on standard error with the time that has passed; where steps are counted, with what is left at their pace.

    A task without a total shows no share and no estimate: nobody knows them.
    """
    return Progress(
        _NameColumn(""), BarColumn(bar_width=30), TaskProgressColumn(),
        TimeElapsedColumn(), _LeftColumn(),
        console=console, transient=True, disable=console.quiet or not console.is_terminal,
    )  # fmt: skip


@contextmanager
def working(text: str) -> Iterator[Callable[[str], None]]:
    """A bar for work whose steps nobody can count beforehand; where none shows, a line for each stage.

    Yields
    ------
    callable
        Say what is done now; with ``--verbose`` each is a line that stays.
    """
    started = time.perf_counter()
    waiting = threading.Timer(0.0, stage)
    with progress_bar() as bar:
        task = bar.add_task(text, total=None)

        def begin(what: str) -> None:
            nonlocal waiting
            waiting.cancel()
            line = f"{time.perf_counter() - started:6.1f} s  {what}"
            bar.update(task, description=what)
            if _verbose:
                say(line)
            else:
                waiting = threading.Timer(SAID_AFTER_s, stage, [line])
                waiting.daemon = True
                waiting.start()

        try:
            begin(text)
            yield begin
            if _verbose:
                begin("done")
        finally:
            waiting.cancel()


class _NameColumn(TextColumn):
    """What is done, with names as strangers may have written them."""

    def render(self, task: Task) -> Text:
        return Text(printable(task.description))


class _LeftColumn(TimeRemainingColumn):
    """What is left at the pace so far; empty until there is one."""

    def render(self, task: Task) -> Text:
        return (
            Text("")
            if task.time_remaining is None
            else Text("about ").append_text(super().render(task)).append(" left")
        )
