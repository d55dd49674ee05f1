"""The option that brings causes from outside the package."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click


def _load(context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> tuple[Path, ...]:
    from twin.causes import load_causes

    for path in files:
        load_causes(path)
    return files


def causes_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--causes FILE.py``; the causes are known before any other option is looked at."""
    return click.option(
        "--causes", "cause_files", multiple=True, metavar="FILE.py", type=click.Path(path_type=Path), callback=_load,
        is_eager=True, expose_value=False, help="Causes of your own (Python, which is run); repeatable.",
    )(function)  # fmt: skip
