"""A report: an answer, then sections of texts, tables and pictures; one HTML file without a network, or plain text."""

from __future__ import annotations

import base64
import hashlib
import io
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import TYPE_CHECKING

from recordings.errors import InputError
from recordings.whole import whole_file
from twin.views.style import AFTER
from twin.views.table import Table, markdown_text, table_markdown, template

if TYPE_CHECKING:
    from matplotlib.figure import Figure  # which takes a while to load

DPI = 130
LEFT_OUT = "What the rig file leaves out, and what stands for it"
"""Title of the list that reports begin with."""


@dataclass(frozen=True, kw_only=True)
class Picture:
    """A figure, drawn when the page is written, with what it shows in words for those who cannot see it."""

    draw: Callable[[], Figure]
    alt: str
    caption: str


@dataclass(frozen=True, kw_only=True)
class Section:
    """One part of the page, in the order of its attributes."""

    title: str
    texts: Sequence[str] = ()
    tables: Sequence[Table] = ()
    items: Sequence[str] = ()
    pictures: Sequence[Picture] = ()
    commands: Sequence[str] = ()


@dataclass(frozen=True, kw_only=True)
class Page:
    """A report."""

    title: str
    answer: str
    """In one sentence; it comes first."""
    facts: str
    """One line beneath it."""
    sections: Sequence[Section]
    accent: str = AFTER
    """Colour of the bar beside the answer."""
    files: Sequence[str] = ()
    """What it was made from; those that are there are told with their SHA-256."""

    def beginning(self, title: str, items: Sequence[str]) -> Page:
        """The page with a list before all its sections, if there is anything in it."""
        return replace(self, sections=[Section(title=title, items=items), *self.sections]) if items else self

    def write(self, path: Path, *, commands: Sequence[str] = ()) -> None:
        """Write the page as HTML, whole or not at all; a file that is there is replaced.

        InputError if `path` cannot be written.

        Parameters
        ----------
        commands
            What to type to get the same again.
        """
        if not path.parent.is_dir():  # before anything is drawn
            raise InputError(path, "", f"cannot be written: there is no folder {path.parent}")
        sections = [*self.sections, self._origin(commands)]
        text = template("report.html").render(page=self, sections=sections, embedded=_embedded)
        with whole_file(path) as part:
            part.write_text(text, encoding="utf-8")

    def markdown(self) -> str:
        """The page without its pictures, for a text pane."""
        blocks = [f"# {markdown_text(self.title)}", markdown_text(self.answer), markdown_text(self.facts)]
        for section in [*self.sections, self._origin(())]:
            blocks += [f"## {markdown_text(section.title)}", *map(markdown_text, section.texts)]
            blocks += map(table_markdown, section.tables)
            blocks += ["\n".join(f"- {markdown_text(item)}" for item in section.items)] if section.items else []
        return "\n\n".join(blocks)

    def _origin(self, commands: Sequence[str]) -> Section:
        """When, by what and from which files it was made."""
        files = [file for name in dict.fromkeys(self.files) if (file := Path(name).absolute()).is_file()]
        table = Table(
            caption="The files, with what tells that they are still the same",
            head=("file", "bytes", "SHA-256"),
            rows=[(file.name, str(file.stat().st_size), _sha256(file, file.stat().st_mtime_ns)) for file in files],
            numbers=(1,),
        )
        made = f"Made on {datetime.now(UTC):%Y-%m-%d at %H:%M} UTC by virtual-test-rig {version('virtual-test-rig')}."
        tables = [table] if files else []
        return Section(title="How this was made", texts=[made], tables=tables, commands=commands)


@lru_cache
def _sha256(path: Path, changed_ns: int) -> str:
    """Of a file that was last changed then: a report and the view beside it tell the same files."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _embedded(picture: Picture) -> dict[str, str | int]:
    """A picture as the page holds it: a PNG as a data URI, and its size."""
    figure, buffer = picture.draw(), io.BytesIO()
    figure.savefig(buffer, format="png", dpi=DPI, facecolor="white")
    width, height = (round(size * DPI) for size in figure.get_size_inches())
    return {
        "source": "data:image/png;base64," + base64.b64encode(buffer.getvalue()).decode(),
        "width": width, "height": height,
    }  # fmt: skip
