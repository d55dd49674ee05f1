"""The Python of the README, the guides and the notebooks passes mypy strictly, as a reader's editor runs it."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from guide_script import read_blocks
from needed import package

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
CELL = re.compile(r"^```\{code-cell\} python\n(.*?)^```$", re.MULTILINE | re.DOTALL)


def scripts() -> dict[str, str]:
    """Every block of the pages as a script of its own, and every notebook's cells as one, by a name for its file."""
    pages = [ROOT / "README.md", *(path for path in DOCS.glob("*.md") if path.name != "index.md")]
    blocks = {
        f"{page.stem}_{block.line}": block.content
        for page in pages
        for block in read_blocks(page.read_text(encoding="utf-8"))
        if block.language == "python"
    }
    notebooks = {
        page.stem: "\n".join(CELL.findall(page.read_text(encoding="utf-8"))) for page in DOCS.glob("notebooks/*.md")
    }
    return {name.replace("-", "_").lower(): text for name, text in (blocks | notebooks).items()}


STRICTLY = """
[mypy]
strict = True
follow_imports = silent
ignore_missing_imports = True
disallow_untyped_decorators = False
[mypy-numba.*]
follow_imports = skip
"""
"""As a reader's editor has it; numba's own types know no bare ``@njit``."""


def strict(folder: Path, files: dict[str, str]) -> str:
    """What mypy says of them."""
    package("mypy")
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text, encoding="utf-8")
    (folder / "mypy.ini").write_text(STRICTLY, encoding="utf-8")
    command = [sys.executable, "-m", "mypy", "--config-file", folder / "mypy.ini", "--cache-dir", folder / "cache"]
    written = [folder / f"{name}.py" for name in files]
    done = subprocess.run([*command, *written], cwd=ROOT, capture_output=True, text=True, timeout=900, check=False)
    return done.stdout


@pytest.mark.slow
def test_strictly_typed(tmp_path: Path) -> None:
    written = scripts()
    assert len(written) > 12
    wrong = "import twin\n\ntwin.load_rig(3).diagnoze()\n"
    said = strict(tmp_path, {**written, "wrong": wrong})
    assert {line.partition(":")[0].rpartition("/")[2] for line in said.splitlines() if ": error:" in line} == {
        "wrong.py"
    }, said
    assert "diagnoze" in said
