"""A judge must not borrow from the judged."""

import ast
from pathlib import Path

import pytest

FILES = sorted(Path(__file__).parent.rglob("*.py"))


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_the_second_bench_knows_nothing_of_the_tool(path):
    used = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            used |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            used.add(str(node.module))
    assert not {name for name in used if name.split(".")[0] in ("twin", "drivers")}
    assert all(name.startswith("tests.second_bench") for name in used if name.startswith("tests"))
