"""A number that decides something stands in its folder's table, with what it means and where it comes from."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).parents[1]
MOST = 250
"""Numbers that may stand alone at the top of a module: iterations, sizes, and what compiled kernels read."""


def is_number(node: ast.expr) -> bool:
    """A number, also negative or as a power or product of numbers."""
    match node:
        case ast.Constant():
            return isinstance(node.value, int | float) and not isinstance(node.value, bool)
        case ast.UnaryOp():
            return is_number(node.operand)
        case ast.BinOp():
            return is_number(node.left) and is_number(node.right)
        case ast.Tuple():
            return bool(node.elts) and all(is_number(each) and not isinstance(each, ast.Tuple) for each in node.elts)
    return False


def numbers(path: Path) -> Iterator[str]:
    for statement in ast.parse(path.read_text(encoding="utf-8")).body:
        if isinstance(statement, ast.Assign):
            target, value = statement.targets[0], statement.value
            if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple):
                pairs = zip(target.elts, value.elts, strict=True)
            else:
                pairs = iter([(target, value)])
            yield from (ast.unparse(name) for name, number in pairs if is_number(number))


def test_few_numbers_stand_outside_of_their_folders_table():
    found = [f"{path.relative_to(ROOT)}: {name}" for path in (ROOT / "twin").rglob("*.py") for name in numbers(path)]
    assert len(found) <= MOST, "\n".join(sorted(found))


def test_each_number_of_a_table_says_what_it_means():
    """Or the one below it does, where two belong together."""
    for path in (ROOT / "twin").rglob("limits.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if isinstance(node, ast.ClassDef) and node.name == "Limits":
                assert isinstance(node.body[-1], ast.Expr), path
                assert sum(isinstance(each, ast.Expr) for each in node.body) * 2 >= len(node.body) / 1.5, path
