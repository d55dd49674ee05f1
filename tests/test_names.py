"""One name means one thing, and it is the field's: made-up names that were given up do not come back."""

from __future__ import annotations

import ast
import re
from collections import defaultdict
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("recordings", "drivers", "twin", "studies", "benchmarks")
GIVEN_UP = {
    "Evidence": "MeasuredData",
    "Blame": "hypothesis of a cause",
    "Candidate": "FittedModel",
    "Trial": "FittedModel",
    "Footing": "BaseFit",
    "Climb": "Search",
    "tournament": "racing",
    "shortlist": "screening by the score test",
    "Slack": "level of the discrepancy",
    "paying": "acceptance",
    "excused": "expected_residual_chi2",
    "left_behind": "expected_residual_chi2",
    "temper": "overdispersion",
    "detuning": "frequency_discrepancy",
    "Unknowns": "BaselineParameters",
    "BaseParameters": "LinearParameters",
    "Extension": "ModelModification",
    "ExtendedRig": "ForwardModel",
    "extended_rig": "updated_rig",
    "Predictor": "ResidualModel",
    "believed": "nominal",
    "alternation": "aft",
    "softened": "structural_modification",
    "Sliders": "ParallelJenkins",
    "Hinges": "PiecewiseLinearContact",
    "side_by_side": "parallel_map",
    "imagine": "predicted_data",
    "RIVAL": "the quantity",
    "CLEAR": "the quantity",
    "regularisation": "l_curve",
    "sliders": "jenkins_element",
    "diagnose_evidence": "diagnose_data",
    "weigh": "weighed",
    "continue_over": "branch",
}
"""Names of modules, classes, functions and constants, and what they are called instead."""


def files() -> list[Path]:
    return [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]


def defined(tree: ast.Module) -> Iterator[str]:
    """Classes and functions, wherever they stand, and what a module assigns."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name
    for statement in tree.body:
        if isinstance(statement, ast.Assign | ast.AnnAssign):
            targets = statement.targets if isinstance(statement, ast.Assign) else [statement.target]
            yield from (node.id for target in targets for node in ast.walk(target) if isinstance(node, ast.Name))


@pytest.mark.parametrize("package", PACKAGES)
def test_no_name_that_was_given_up_is_defined(package):
    found = []
    for path in sorted((ROOT / package).rglob("*.py")):
        names = {path.stem, path.parent.name, *defined(ast.parse(path.read_text(encoding="utf-8")))}
        found += [f"{path.relative_to(ROOT)}: {name}, {GIVEN_UP[name]} now" for name in sorted(names & set(GIVEN_UP))]
    assert found == []


def test_no_two_classes_of_a_package_share_a_name():
    """But the tables of limits, one a folder; what is private to a module; and what files of one's own import."""
    shared = {"Limits", "Parameter", "Finding"}
    places = defaultdict(set)
    for path in files():
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.ClassDef) and not node.name.startswith("_") and node.name not in shared:
                places[path.relative_to(ROOT).parts[0], node.name].add(path.relative_to(ROOT).as_posix())
    assert {name: sorted(where) for name, where in places.items() if len(where) > 1} == {}


def test_a_law_offers_its_force_history_and_its_describing_function():
    for path in sorted((ROOT / "twin" / "joint").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        assert re.search(r"def (path|stiffness)\(self, (e|amplitude)\b", text) is None, path.name
