"""Options and types of arguments that several commands share."""

import math
from collections.abc import Callable
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import click

from twin.commands.common.output import console, set_verbose

Decorator = Callable[[Callable[..., Any]], Callable[..., Any]]

FILE = click.Path(path_type=Path)
LONGEST_s = 600.0
"""Several times what a diagnosis of three sweeps takes on two slow cores."""


class FiniteRange(click.FloatRange):
    """A range of numbers; what is no number (nan), which is neither below nor above a bound, is refused."""

    def convert(self, value: float, param: click.Parameter | None, ctx: click.Context | None) -> float:
        """As click does, and finite."""
        number = float(super().convert(value, param, ctx))
        if not math.isfinite(number):
            self.fail(f"{value!r} is not a finite number", param, ctx)
        return number


def json_option(function: Callable[..., Any]) -> Callable[..., Any]:
    """Add what every command takes: ``--json`` as the argument `as_json`, ``--quiet`` and ``--verbose``."""
    options = [
        click.option("--json", "as_json", is_flag=True, help="One JSON object on standard output."),
        click.option(
            "-q", "--quiet", is_flag=True, expose_value=False, callback=_set_quiet,
            help="No progress, no remarks: errors alone on standard error.",
        ),
        click.option(
            "-v", "--verbose", is_flag=True, expose_value=False, callback=lambda *given: set_verbose(given[-1]),
            help="What is done and when; where an error came from.",
        ),
    ]  # fmt: skip
    for option in reversed(options):
        function = option(function)
    return function


def _set_quiet(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    context.call_on_close(partial(setattr, console, "quiet", console.quiet))  # of the command that called this one
    console.quiet = wanted


overwrite_option = click.option("--overwrite", is_flag=True, help="Replace what is there, once the new one is whole.")
"""Add ``--overwrite``: without it nothing that exists is touched."""

scatter_option = click.option(
    "--frequency-scatter", metavar="SHARE", type=click.FloatRange(min=0, max=0.1, max_open=True),
    help="Of frequency responses: how natural frequencies scatter from one assembly to the next, as 0.003; by default "
    "what several cases of one state show, or the rig file says.",
)  # fmt: skip


time_limit_option = click.option(
    "--time-limit", "time_limit_s", metavar="S", type=FiniteRange(1e-3, 1e6), default=LONGEST_s, show_default=True,
    help="Seconds after which a diagnosis' search ends where it is, and the answer says so.",
)  # fmt: skip


def _files_option(name: str, module: str, load: str, told: str) -> Decorator:
    """An option that hands each file to a function of a module, which is imported when there is one."""

    def run(context: click.Context, parameter: click.Parameter, files: tuple[Path, ...]) -> None:
        if files and not context.resilient_parsing:
            for file in files:
                getattr(import_module(module), load)(file)

    return click.option(
        name, f"{name.lstrip('-')}_files", multiple=True, metavar="FILE.py", type=FILE, callback=run, is_eager=True,
        expose_value=False, help=told,
    )  # fmt: skip


causes_option = _files_option(
    "--causes", "twin.cause_registry", "load_causes", "Causes of your own (Python, which is run); repeatable."
)
laws_option = _files_option(
    "--laws", "twin.joint", "load_laws", "Python file with laws of joints that the rig names; it is run."
)
