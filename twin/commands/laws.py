"""``--laws``: laws of the joint from a file, which a rig file may then name."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def laws_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--laws``, which runs the files that it names before the command reads a rig."""
    return click.option(
        "--laws", "law_files", multiple=True, metavar="FILE.py", type=click.Path(path_type=Path), is_eager=True,
        expose_value=False, callback=_load, help="Python file with laws of joints that the rig names; it is run.",
    )(function)  # fmt: skip


def laws_words() -> list[str]:
    """The option as it was given, for the command line that a report repeats."""
    from twin.joint.registry import loaded_files

    return [word for file in loaded_files() for word in ("--laws", str(file))]


def _load(context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> None:
    if not files or context.resilient_parsing:
        return
    from twin.joint import load_laws

    for file in files:
        load_laws(file)
