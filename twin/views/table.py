"""A table of words and numbers: as plain text, as Markdown, and as HTML for notebooks and pages."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import jinja2

NARROW = 4
"""Columns that a text pane has room for."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; the columns whose numbers are in `numbers` are set to the right."""

    caption: str
    head: Sequence[str]
    rows: Sequence[Sequence[str]]
    numbers: Sequence[int] = ()


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
    if len(table.head) > NARROW:
        others = table.head[1:]
        lines = [
            f"- **{first}**: " + "; ".join(f"{name} {cell}" for name, cell in zip(others, rest, strict=True) if cell)
            for first, *rest in table.rows
        ]
    else:
        lines = [f"| {' | '.join(cells)} |" for cells in (table.head, ["---"] * len(table.head), *table.rows)]
    return "\n".join([table.caption, "", *lines])


def table_html(table: Table) -> str:
    """The table as the pages have it, without their style."""
    return str(template("table.html").module.drawn(table))  # type: ignore[attr-defined]


@cache
def template(name: str) -> jinja2.Template:
    """A template by its file's name; what is filled in is escaped, and what is missing is an error."""
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("twin.views", ""),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(name)
