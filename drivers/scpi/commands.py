"""The command table: one decorator a command, headers in long and short form, and a printed table.

A header is written as in an instrument's manual: ``SOURce:FREQuency``, ``OUTPut[:STATe]`` (what is in brackets may be
left out), ``CHANnel#:DESCription?`` (a number belongs at ``#``; 1 if left out), ``*IDN?``.  The query of a number that
can be set also takes MINimum or MAXimum, and gives the limit.
"""

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, replace
from itertools import product
from typing import Any, TypeVar

from drivers.scpi.errors import ScpiError
from drivers.scpi.values import Number, Parameter, short_form

Function = TypeVar("Function", bound=Callable[..., object])
_OPTION = re.compile(r"(\[[^\]]+\])")
_CACHE_LIMIT = 512


@dataclass(frozen=True)
class Command:
    """One row of the table."""

    header: str
    parameters: tuple[Parameter, ...]
    optional: int
    function: Callable[..., object]
    controls: bool = False
    """Whether it is for the instrument's controller alone; others may ask."""
    settable: Number | None = None
    """What a query's setting takes, where that is one number."""

    @property
    def is_query(self) -> bool:
        """Whether it answers."""
        return self.header.endswith("?")

    @property
    def summary(self) -> str:
        """First line of the function's docstring."""
        return (self.function.__doc__ or "").strip().splitlines()[0]

    @property
    def described(self) -> list[str]:
        """Its parameters, for the table; in brackets what may be left out."""
        needed = len(self.parameters) - self.optional
        words = [parameter.describe() for parameter in self.parameters]
        return [*words[:needed], *(f"[{word}]" for word in words[needed:])]

    def call(self, instrument: object, suffixes: tuple[int, ...], arguments: list[str]) -> object:
        """Check the parameters and do it."""
        if self.settable is not None and len(arguments) == 1:
            return self.settable.limit(arguments[0])
        if len(arguments) > len(self.parameters):
            raise ScpiError(-108, f"{self.header} takes {len(self.parameters)} parameter(s)")
        if len(arguments) < len(self.parameters) - self.optional:
            raise ScpiError(-109, f"{self.header} takes {len(self.parameters)} parameter(s)")
        values = [parameter.parse(text) for parameter, text in zip(self.parameters, arguments, strict=False)]
        return self.function(instrument, *suffixes, *values)


def command(
    header: str, *parameters: Parameter, optional: int = 0, controls: bool | None = None
) -> Callable[[Function], Function]:
    """Make a method answer a header; the last `optional` parameters may be left out.

    If `controls` is not said, what sets something controls the instrument, but for a client's own registers.
    """
    if controls is None:
        controls = not header.endswith("?") and not header.startswith(("*", "STATus", "SYSTem"))
    row_controls = controls

    def mark(function: Function) -> Function:
        rows: list[Command] = getattr(function, "scpi_commands", [])
        row = Command(header, parameters, optional, function, row_controls)
        function.scpi_commands = [*rows, row]  # type: ignore[attr-defined]
        return function

    return mark


class CommandTable:
    """All commands of an instrument's class, looked up by header."""

    def __init__(self, commands: Iterable[Command]) -> None:
        self.commands = tuple(commands)
        self._patterns = [(re.compile(_pattern(row.header)), row) for row in self.commands]
        self._found: dict[str, tuple[Command, tuple[int, ...]]] = {}

    def find(self, header: str) -> tuple[Command, tuple[int, ...]]:
        """The command of a full header and the numbers in it; raises ScpiError -113."""
        known = self._found.get(header)
        if known is not None:
            return known
        for pattern, row in self._patterns:
            match = pattern.fullmatch(header.upper())
            if match:
                suffixes = tuple(int(text or 1) for text in match.groups())
                if len(self._found) < _CACHE_LIMIT:  # a stranger may send any number of different headers
                    self._found[header] = row, suffixes
                return row, suffixes
        raise ScpiError(-113, header[:60])

    def describe(self) -> str:
        """The table as text: header, parameters, what it does."""
        rows = [(row.header, ",".join(row.described), row.summary) for row in self.commands]
        widths = [max(len(row[i]) for row in rows) for i in (0, 1)]
        return "\n".join(f"{a:<{widths[0]}}  {b:<{widths[1]}}  {c}".rstrip() for a, b, c in rows)


def command_table(instrument: type) -> CommandTable:
    """Collect the commands of a class and its bases, in the order they are written."""
    found: dict[str, Command] = {}
    for cls in reversed(instrument.__mro__):
        for member in vars(cls).values():
            rows: Any = getattr(member, "scpi_commands", [])
            found.update({row.header: row for row in rows})
    return CommandTable(_with_limits(row, found) for row in found.values())


def _with_limits(row: Command, table: Mapping[str, Command]) -> Command:
    """A query that knows what its setting takes."""
    setting = table.get(row.header.removesuffix("?"))
    if not row.is_query or row.parameters or setting is None or len(setting.parameters) != 1:
        return row
    parameter = setting.parameters[0]
    return replace(row, settable=parameter) if isinstance(parameter, Number) else row


def _pattern(header: str) -> str:
    """Regular expression of a header in capitals; a number is a group."""
    query = header.endswith("?")
    parts = _OPTION.split(header.removesuffix("?"))
    choices = [(part, "") if i % 2 == 0 else (part[1:-1], "") for i, part in enumerate(parts)]
    alternatives = []
    for pick in product((True, False), repeat=len(parts) // 2):
        text = "".join(choice[0] if i % 2 == 0 or pick[i // 2] else "" for i, choice in enumerate(choices)).strip(":")
        alternatives.append(":".join(_mnemonic(node) for node in text.split(":")))
    if len(alternatives) > 1 and "#" in header:
        raise ValueError(f"{header}: a number and an option in one header are not supported")
    return f"(?:{'|'.join(alternatives)})" + (r"\?" if query else "")


def _mnemonic(node: str) -> str:
    """Long or short form, with a group for its number."""
    numbered = node.endswith("#")
    name = node.removesuffix("#")
    forms = sorted({re.escape(name.upper()), re.escape(short_form(name))}, key=len, reverse=True)
    return f"(?:{'|'.join(forms)})" + (r"(\d{0,4})" if numbered else "")
