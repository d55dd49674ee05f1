"""What pictures, reports and answers say holds for any rig: no word of a clamped lap joint stands in them."""

import ast
import re
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[3] / "twin"
OF_CANTILEVERS = re.compile(r"\btip\b|from the clamp|\boverlap\b|\b(upper|lower) beam\b", re.IGNORECASE)
FOLDERS = ("views", "causes", "diagnose", "identify", "lab", "checks", "rehearsal", "campaign", "exchange", "commands")


def strings(path):
    """Every string of a module that is no docstring, with its line."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    bodies = [node.body for node in ast.walk(tree) if isinstance(getattr(node, "body", None), list)]
    described = {
        id(statement.value) for body in bodies for statement in body
        if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Constant)
    }  # fmt: skip
    for node in ast.walk(tree):
        if isinstance(node, ast.Constant) and isinstance(node.value, str) and id(node) not in described:
            yield node.lineno, node.value


@pytest.mark.parametrize("folder", FOLDERS)
def test_no_text_speaks_of_a_clamped_lap_joint(folder):
    found = [
        f"{path.relative_to(PACKAGE)}:{line}: {text!r}"
        for path in sorted((PACKAGE / folder).rglob("*.py"))
        for line, text in strings(path)
        if OF_CANTILEVERS.search(text)
    ]
    found += [
        f"{path.name}: {match.group()}"
        for path in (PACKAGE / folder).glob("*.html")
        for match in OF_CANTILEVERS.finditer(path.read_text(encoding="utf-8"))
    ]
    assert found == []
