"""A self-contained page: an answer, then sections of texts, tables and pictures, in one HTML file without a network."""

from __future__ import annotations

import base64
import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from recordings.errors import InputError
from recordings.whole import whole_file
from twin.views.table import Table
from twin.views.templates import template

__all__ = ["Picture", "Section", "Table", "picture", "require_folder", "write_page"]

DPI = 130


@dataclass(frozen=True, kw_only=True)
class Picture:
    """An image as a data URI, with what it shows in words for those who cannot see it."""

    source: str
    alt: str
    caption: str
    width: int
    height: int


@dataclass(frozen=True, kw_only=True)
class Section:
    """One part of the page, in the order of its attributes."""

    title: str
    texts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    items: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    commands: Sequence[str] = ()


def require_folder(path: Path) -> None:
    """Refuse a file in a folder that is not there, before anything is drawn for it.

    Raises
    ------
    InputError
        If it is not.
    """
    if not path.parent.is_dir():
        raise InputError(path, "", f"cannot be written: there is no folder {path.parent}")


def picture(figure: Figure, *, alt: str, caption: str) -> Picture:
    """A figure as PNG within the page."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, facecolor="white")
    width, height = (round(size * DPI) for size in figure.get_size_inches())
    source = "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode()
    return Picture(source=source, alt=alt, caption=caption, width=width, height=height)


def write_page(
    path: Path, *, title: str, answer: str, facts: str = "", sections: Sequence[Section], accent: str = "#0072b2"
) -> None:
    """Render and write the page, whole or not at all.

    Parameters
    ----------
    answer
        The answer in one sentence; it comes first.
    facts
        One line beneath it.
    accent
        Colour of the bar beside the answer.

    Raises
    ------
    InputError
        If `path` cannot be written.
    """
    text = template("report.html").render(title=title, answer=answer, facts=facts, sections=sections, accent=accent)
    with whole_file(path) as part:
        part.write_text(text, encoding="utf-8")
