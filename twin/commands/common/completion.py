"""Completion in the shell: the scripts, and names of shipped rigs and procedures beside files."""

import importlib
from collections.abc import Mapping

import click
from click.shell_completion import CompletionItem, get_completion_class


class NameOrFile(click.ParamType):
    """Text that is the name of something shipped, or a file.

    Parameters
    ----------
    module, table
        Where the mapping of shipped names is; imported when it is needed.
    """

    def __init__(self, name: str, module: str, table: str) -> None:
        self.name = name
        self._module, self._table = module, table

    def shell_complete(self, ctx: click.Context, param: click.Parameter, incomplete: str) -> list[CompletionItem]:
        """Shipped names that begin so, and files."""
        shipped: Mapping[str, object] = getattr(importlib.import_module(self._module), self._table)
        names = [CompletionItem(name) for name in shipped if name.startswith(incomplete)]
        return [*names, CompletionItem(incomplete, type="file")]


_NAMED = {
    "RIG": NameOrFile("rig", "twin.rigs", "RIG_FILES"),
    "PROCEDURE": NameOrFile("procedure", "twin.procedures", "PROCEDURE_FILES"),
}


def named_types(command: click.Command) -> None:
    """Let a command's arguments that are shown as RIG or PROCEDURE complete to shipped names and files."""
    for parameter in command.params:
        named = _NAMED.get((parameter.metavar or "").strip("[]"))
        if named is not None and parameter.type is click.STRING:
            parameter.type = named


def completion_script(command: click.Command, shell: str) -> str:
    """What a shell reads to complete `command`, which is called ``twin`` there."""
    kind = get_completion_class(shell)
    assert kind is not None
    return kind(command, {}, "twin", "_TWIN_COMPLETE").source()
