"""A stranger who knows the field finds a thing by the name of its file; the table of docs/CONTRIBUTING.md says so."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "CONTRIBUTING.md").read_text(encoding="utf-8")
ROWS = dict(
    re.findall(r"^\| (?:where is |the |the rule of the )?(.+?)\? \| \[.*?\]\(\.\./(.+?)\) \|$", PAGE, re.MULTILINE)
)
ASKED = {
    "L-curve": "l_curve",
    "thin layer": "thin_layer",
    "describing function": "describing_function",
    "score test": "score_test",
    "error model": "error_model",
    "verdict": "verdict",
    "SCPI parser": "scpi/parser",
    "joint-slap": "joint_slap/model",
}
"""What a stranger asks for, and what he would look for among the names of files."""


def named(words: str) -> list[str]:
    """Files and folders of the three packages whose path ends so."""
    paths = (path for package in ("recordings", "drivers", "twin") for path in (ROOT / package).rglob("*"))
    names = {
        path.relative_to(ROOT).with_suffix("").as_posix(): path for path in paths if "__pycache__" not in path.parts
    }
    return [path.relative_to(ROOT).as_posix() for name, path in names.items() if f"/{name}".endswith(f"/{words}")]


@pytest.mark.parametrize("term", ASKED)
def test_a_stranger_finds_one_file_by_the_standard_term(term):
    (row,) = [file for question, file in ROWS.items() if term.lower() in question.lower()]
    assert named(ASKED[term]) == [row]


@pytest.mark.parametrize("question", ROWS)
def test_the_file_that_the_table_names_says_that_it_is_the_place(question):
    text = (ROOT / ROWS[question]).read_text(encoding="utf-8").lower().replace("_", "-")
    words = set(re.findall(r"[a-z]{4,}", question.lower())) - {"where", "cause"}
    assert [word for word in words if word[:6] not in text] == []


def test_where_a_verdict_is_decided_takes_two_files():
    """The rule in one, how probable each hypothesis is in the other; whoever needs a verdict asks the first."""
    texts = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "twin" / "diagnose").glob("*.py")}
    defined = [name for name, text in texts.items() if re.search(r"^def (decide|probabilities)\(", text, re.MULTILINE)]
    assert sorted(defined) == ["posterior.py", "verdict.py"]
    assert "from twin.diagnose.posterior import" in texts["verdict.py"]


def test_every_file_of_the_project_that_a_page_names_is_there():
    pages = [ROOT / "README.md", *(ROOT / "docs").rglob("*.md")]
    named_in = [
        (page.name, path)
        for page in pages
        for path in re.findall(r"`((?:twin|drivers|recordings|studies|tests|docs)/[\w./-]+)`", page.read_text("utf-8"))
    ]
    assert len(named_in) > 20
    assert [found for found in named_in if not (ROOT / found[1]).exists()] == []
