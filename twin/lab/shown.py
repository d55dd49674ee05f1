"""What prints as readable tables, in a terminal and in a notebook."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING

from twin.views.table import Table, table_html, table_text

if TYPE_CHECKING:
    from twin.views.page import Page


class Shown(ABC):
    """A result that is shown as a sentence and tables."""

    @property
    @abstractmethod
    def sentence(self) -> str:
        """What it says, in one sentence."""

    @abstractmethod
    def tables(self) -> Sequence[Table]:
        """The figures behind it."""

    def __repr__(self) -> str:
        return "\n\n".join([self.sentence, *map(table_text, self.tables())])

    def _repr_html_(self) -> str:
        return "\n".join([f"<p>{escape(self.sentence)}</p>", *map(table_html, self.tables())])


class Reported(Shown):
    """A result that has a report of its own."""

    @abstractmethod
    def page(self) -> Page:
        """The report."""

    def report(self, path: str | Path, *, commands: Sequence[str] = (), files: Sequence[str | Path] = ()) -> None:
        """Write the report as one HTML page.

        Parameters
        ----------
        commands
            What to type to get it again.
        files
            What it was made from beside the recordings, as the rig file: told with its SHA-256.
        """
        page = self.page()
        replace(page, files=(*map(str, files), *page.files)).write(Path(path), commands=commands)
