"""How commands speak: one JSON object on standard output when asked, everything else on standard error."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click
import numpy as np
from rich.console import Console
from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

__all__ = ["console", "json_option", "plain", "print_json", "progress_bar", "write_json"]

console = Console(stderr=True, highlight=False)
"""Progress, warnings and tables for people."""


def json_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add ``--json`` to a command as the argument `as_json`."""
    return click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output.")(function)


def plain(value: Any) -> Any:
    """`value` with numpy scalars, arrays and paths turned into what JSON knows; NaN and infinity become null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, np.ndarray):
        return plain(value.tolist())
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, Path):
        return str(value)
    return value


def print_json(result: Mapping[str, Any]) -> None:
    """Write one JSON object to standard output."""
    click.echo(json.dumps(plain(result), indent=2, allow_nan=False))


def write_json(result: Mapping[str, Any], path: Path) -> None:
    """Write one JSON object to a file."""
    path.write_text(json.dumps(plain(result), indent=2, allow_nan=False) + "\n", encoding="utf-8")


def progress_bar() -> Progress:
    """A progress bar with the time left, on standard error."""
    return Progress(
        TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn(),
        console=console, transient=True, disable=not console.is_terminal,
    )  # fmt: skip
