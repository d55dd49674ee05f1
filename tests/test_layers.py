"""Imports run one way; `lint-imports` holds what can be said of packages, and here is the rest."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections import Counter
from pathlib import Path

import pytest
from importlinter import cli

ROOT = Path(__file__).parents[1]


def test_every_folder_keeps_its_contract(monkeypatch, capsys):
    monkeypatch.chdir(ROOT)
    status = cli.lint_imports(config_filename=".ci/layers.toml", no_cache=True)
    assert status == cli.EXIT_STATUS_SUCCESS, capsys.readouterr().out


def test_every_folder_of_twin_has_a_contract():
    """A new one is asked who may import it; that it stands in the order of layers the linter asks itself."""
    contracts = (ROOT / ".ci" / "layers.toml").read_text(encoding="utf-8")
    folders = {path.parent.name for path in (ROOT / "twin").glob("*/__init__.py")} - {"commands"}
    assert [name for name in sorted(folders) if f'protected_modules = ["twin.{name}"]' not in contracts] == []


@pytest.mark.parametrize("package", ["recordings", "drivers", "twin", "studies", "benchmarks"])
def test_a_folder_and_a_file_are_seen_at_a_glance(package):
    """A folder that grows beyond that is several nouns, a file several ideas."""
    files = sorted((ROOT / package).rglob("*.py"))
    many = Counter(path.parent.relative_to(ROOT).as_posix() for path in files)
    assert {folder: count for folder, count in many.items() if count > 25} == {}
    long = [path.name for path in files if len(path.read_text(encoding="utf-8").splitlines()) > 400]
    assert long == []


OF_A_CAUSE = {
    "effect.py": {"bench", "joint", "rigs", "structure"},
    "model.py": {"causes", "diagnose", "identify", "joint", "rigs", "structure"},
    "finding.py": {"diagnose", "identify"},
    "__init__.py": {"cause_registry"},
}
"""What each part of a cause may use: what acts on the bench and what is inferred never meet."""


def imported_by(path: Path) -> set[str]:
    """Modules that a file imports, also inside functions and for types only."""
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    plain = {alias.name for node in nodes if isinstance(node, ast.Import) for alias in node.names}
    return plain | {str(node.module) for node in nodes if isinstance(node, ast.ImportFrom)}


@pytest.mark.parametrize("part", OF_A_CAUSE)
def test_the_two_sides_of_a_cause_never_meet(part):
    """Folders of causes are no packages, so that the linter does not see them."""
    files = sorted((ROOT / "twin" / "causes").rglob(part))
    assert files
    used = {name for path in files for name in imported_by(path)}
    assert {name.split(".")[0] for name in used} & {"drivers", "serial", "can", "studies", "benchmarks"} == set()
    assert {name.split(".")[1] for name in used if name.startswith("twin.")} <= OF_A_CAUSE[part]


def test_opening_a_bench_brings_no_inference():
    """Though its effects stand beside the models.  (A diagnosis has a bench: it rehearses the next test.)"""
    code = (
        "import sys; from twin.bench import EFFECTS; list(EFFECTS.values())\n"
        "print([m for m in sys.modules if m.startswith(('twin.diagnose', 'twin.identify'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_threads_are_set_before_numpy_is_imported():
    code = (
        "import sys, builtins, os\n"
        "real = builtins.__import__\n"
        "def watch(name, *rest):\n"
        "    if name == 'numpy' and 'numpy' not in sys.modules:\n"
        "        print(os.environ.get('OPENBLAS_NUM_THREADS'))\n"
        "    return real(name, *rest)\n"
        "builtins.__import__ = watch\n"
        "import twin.cli\n"
        "import numpy\n"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env={}, timeout=300, check=True)
    assert done.stdout.split() == ["1"]
