"""What an engineer should know of a cause: ``advice.toml`` in its folder, and the page that shows a case of it."""

import tomllib
from dataclasses import dataclass
from pathlib import Path

CAUSES = Path(__file__).parents[1] / "causes"


@dataclass(frozen=True, kw_only=True)
class Advice:
    """On one cause, in sentences."""

    looks_like: str
    """Its marks in recordings."""
    tell_apart: str
    """How they differ from those of the causes that look like it."""
    on_the_rig: str
    """Where to look and what to change."""
    page: str
    """Of the documents, with a case of it."""


def advice_on(cause: str) -> Advice | None:
    """The advice on a cause by its name; None on one from outside the package."""
    path = CAUSES / cause.replace("-", "_") / "advice.toml"
    if not path.is_file():
        return None
    told = tomllib.loads(path.read_text(encoding="utf-8"))
    return Advice(page=f"docs/causes/{cause}.md", **{key: " ".join(text.split()) for key, text in told.items()})
