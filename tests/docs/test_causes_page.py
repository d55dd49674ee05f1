"""The page of causes says what the causes are."""

import importlib.util
from pathlib import Path

import pytest

from twin.cause_registry.registry import NAMES

DOCS = Path(__file__).parents[2] / "docs"


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_causes", DOCS / "make_causes.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_page_is_the_scripts(script):
    assert (DOCS / "causes.md").read_text(encoding="utf-8") == script.table(), "python docs/make_causes.py"


def test_every_cause_of_the_contract_has_its_row(script):
    rows = dict(line.split(" | ")[:2] for line in script.table().splitlines() if line.startswith("| `"))
    assert set(rows) == {f"| `{name}`" for name in NAMES}
    assert rows["| `attached-resonator`"] == "place, `mass_kg`, `frequency_Hz`, `damping_ratio`"
    assert rows["| `joint-friction`"] == "`stiffness_N_per_m`, `slip_force_N`, [`layer_element`], [`joint`]"
