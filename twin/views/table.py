"""A table of words and numbers: as plain text, as Markdown, and as HTML for notebooks and pages.

Names in it may be strangers': they steer no terminal, and mean nothing in HTML or Markdown.
"""

import re
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any

import jinja2

from recordings.errors import printable

NARROW = 4
"""Columns that a text pane has room for."""
_MARK = re.compile(r"[\\`*\[\]<|&~]|(?<!\w)_|_(?!\w)|^[#>]")
"""What means something in Markdown; an underscore within a word does not."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; the columns whose numbers are in `numbers` are set to the right."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "caption", printable(self.caption))
        object.__setattr__(self, "head", tuple(map(printable, self.head)))
        object.__setattr__(self, "rows", [tuple(map(printable, row)) for row in self.rows])


def table_text(table: Table) -> str:
    """The caption, and below it the columns two spaces apart under a rule."""
    widths = [max(map(len, column)) for column in zip(table.head, *table.rows, strict=True)]

    def line(cells: Sequence[str]) -> str:
        padded = (
            cell.rjust(width) if place in table.numbers else cell.ljust(width)
            for place, (cell, width) in enumerate(zip(cells, widths, strict=True))
        )
        return "  ".join(padded).rstrip()

    rule = "  ".join("─" * width for width in widths)
    return "\n".join([table.caption, line(table.head), rule, *map(line, table.rows)])


def table_markdown(table: Table) -> str:
    """The caption, and below it the table, or a list where it has more columns than a text pane has room for."""
    head, *rows = [[markdown_text(cell) for cell in cells] for cells in (table.head, *table.rows)]
    if len(head) > NARROW:
        lines = [
            f"- **{first}**: " + "; ".join(f"{name} {cell}" for name, cell in zip(head[1:], rest, strict=True) if cell)
            for first, *rest in rows
        ]
    else:
        lines = [f"| {' | '.join(cells)} |" for cells in (head, ["---"] * len(head), *rows)]
    return "\n".join([markdown_text(table.caption), "", *lines])


def markdown_text(text: str) -> str:
    """`text` in one line of Markdown that shows it as it is."""
    return _MARK.sub(r"\\\g<0>", printable(" ".join(text.split())))


def table_html(table: Table) -> str:
    """The table as the pages have it, without their style."""
    return str(template("table.html").module.drawn(table))  # type: ignore[attr-defined]


@cache
def template(name: str) -> jinja2.Template:
    """A template by its file's name; what is filled in is made harmless, and what is missing is an error."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("twin.views", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        finalize=_harmless,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)


def _harmless(value: Any) -> Any:
    """A value for a template: what is no markup of ours has no character that steers."""
    return printable(value) if type(value) is str else value
