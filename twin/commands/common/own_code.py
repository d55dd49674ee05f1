"""``--causes`` and ``--laws``: Python files of one's own, which are run before the command reads anything else."""

from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]


def _files_option(name: str, module: str, load: str, told: str) -> Decorator:
    """An option that hands each file to a function of a module, which is imported when there is one."""

    def run(context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> None:
        if files and not context.resilient_parsing:
            for file in files:
                getattr(import_module(module), load)(file)

    return click.option(
        name, f"{name.lstrip('-')}_files", multiple=True, metavar="FILE.py", type=click.Path(path_type=Path),
        callback=run, is_eager=True, expose_value=False, help=told,
    )  # fmt: skip


causes_option = _files_option(
    "--causes", "twin.cause_registry", "load_causes", "Causes of your own (Python, which is run); repeatable."
)
laws_option = _files_option(
    "--laws", "twin.joint", "load_laws", "Python file with laws of joints that the rig names; it is run."
)
