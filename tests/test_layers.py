"""Imports run one way: recordings, then drivers, then twin; physics never meets a protocol."""

from __future__ import annotations

import ast
import subprocess
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
HARDWARE = {"drivers", "serial", "can", "cantools"}
PHYSICS = sorted(p.name for p in (ROOT / "twin").iterdir() if p.is_dir() and p.name not in ("commands", "__pycache__"))
OUTSIDE = {"studies", "benchmarks"}
"""Packages that use `twin`, and that only its commands use."""
INNER = {
    "structure": {"joint", "rigs", "structure"},
    "joint": {"joint"},
    "rigs": {"joint", "rigs"},
    "diagnose": {"causes", "diagnose", "identify", "joint", "procedures", "rehearsal", "response", "rigs", "structure"},
    "identify": {"identify", "joint", "procedures", "response", "rigs", "structure"},
    "bench": {"bench", "causes", "joint", "rigs", "structure"},
}
"""What a folder of twin may use; above all, an inference never uses the bench, nor the bench an inference."""


def imports(folder: Path) -> Iterator[tuple[str, str]]:
    """(file and line, module imported) of every import in a folder, also those inside functions and for types only."""
    files = sorted(folder.rglob("*.py"))
    assert files, folder
    for path in files:
        yield from imports_of(path)


@cache
def imports_of(path: Path) -> list[tuple[str, str]]:
    found = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        where = f"{path.relative_to(ROOT)}:{getattr(node, 'lineno', 0)}"
        if isinstance(node, ast.Import):
            found += [(where, alias.name) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{where}: relative import"
            found += [(where, str(node.module)), *((where, f"{node.module}.{alias.name}") for alias in node.names)]
    return found


def those_of(folder: Path, forbidden: set[str]) -> list[str]:
    return [f"{where} {name}" for where, name in imports(folder) if name.split(".")[0] in forbidden]


def those_that_use_commands(folder: Path) -> list[str]:
    return [name for _, name in imports(folder) if name.startswith(("twin.commands", "twin.cli"))]


def test_recordings_know_neither_hardware_nor_physics():
    assert those_of(ROOT / "recordings", {"twin", *OUTSIDE, *HARDWARE}) == []


def test_drivers_know_no_physics():
    assert those_of(ROOT / "drivers", {"twin", "scipy", "numba", *OUTSIDE}) == []


@pytest.mark.parametrize("folder", PHYSICS)
def test_only_the_outermost_know_studies_and_benchmarks(folder):
    assert those_of(ROOT / "twin" / folder, OUTSIDE) == []


def test_studies_meet_neither_hardware_nor_benchmarks():
    assert those_of(ROOT / "studies", {"benchmarks", *HARDWARE}) == []


@pytest.mark.parametrize("folder", PHYSICS)
def test_only_the_commands_meet_the_hardware(folder):
    assert those_of(ROOT / "twin" / folder, HARDWARE) == []


@pytest.mark.parametrize("folder", PHYSICS)
def test_nothing_depends_on_the_commands(folder):
    assert those_that_use_commands(ROOT / "twin" / folder) == []


@pytest.mark.parametrize("package", sorted(OUTSIDE))
def test_nothing_outside_depends_on_the_commands(package):
    assert those_that_use_commands(ROOT / package) == []


@pytest.mark.parametrize("folder", INNER)
def test_folders_use_what_lies_below_them(folder):
    used = {name.split(".")[1] for _, name in imports(ROOT / "twin" / folder) if name.startswith("twin.")}
    assert used <= INNER[folder]


OF_A_CAUSE = {
    "effect.py": {"bench", "causes", "joint", "rigs", "structure"},
    "draws.py": {"causes", "rigs"},
    "dice.py": {"rigs"},
    "model.py": {"causes", "diagnose", "identify", "joint", "rigs", "structure"},
    "finding.py": {"causes", "diagnose", "identify"},
    "__init__.py": {"causes"},
}
"""What each part of a cause may use: what acts on the bench and what is inferred never meet."""


@pytest.mark.parametrize("part", OF_A_CAUSE)
def test_the_two_sides_of_a_cause_never_meet(part):
    root = ROOT / "twin" / "causes"
    used = {
        name.split(".")[1]
        for where, name in imports(root)
        if where.partition(":")[0].endswith(f"/{part}") and name.startswith("twin.")
    }
    assert used <= OF_A_CAUSE[part]


def test_opening_a_bench_brings_no_inference():
    """Though its effects stand beside the models.  (A diagnosis has a bench: it rehearses the next test.)"""
    code = (
        "import sys; from twin.bench import EFFECTS; list(EFFECTS.values())\n"
        "print([m for m in sys.modules if m.startswith(('twin.diagnose', 'twin.identify'))])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_rule_sees_imports_inside_functions(tmp_path, monkeypatch):
    monkeypatch.setattr(sys.modules[__name__], "ROOT", tmp_path)
    (tmp_path / "one.py").write_text("def f():\n    from drivers.host import open_instruments\n")
    assert those_of(tmp_path, HARDWARE) == ["one.py:2 drivers.host", "one.py:2 drivers.host.open_instruments"]


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
