"""The benchmarks compare like with like: both sides give the same answer, whatever time they take."""

from __future__ import annotations

import json
import sys

import pytest
from click.testing import CliRunner
from needed import package

from benchmarks.lines import BENCHMARKS
from twin.commands.speed import command


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gauss-newton-step", "gauss-newton-three-modes"])
def test_both_sides_agree(name):
    """The banded full model has all modes; ours eighteen, and the rest as statics."""
    assert 0 <= BENCHMARKS[name]().error < 2e-3


@pytest.mark.slow
def test_mousai_finds_the_same_duffing_response():
    package("mousai", "bench")
    row = BENCHMARKS["duffing"]()
    assert row.error < 1e-4
    assert row.more["ms_a_point"] > 0


def test_a_rival_that_is_not_installed_is_said(monkeypatch):
    monkeypatch.setitem(sys.modules, "mousai", None)
    result = CliRunner().invoke(command, ["--only", "duffing", "--json"])
    assert result.exit_code == 0
    row = json.loads(result.stdout)["duffing"]
    assert row["ratio"] is None
    assert "not installed" in row["against"]


def test_a_line_that_there_is_not_is_bad_usage():
    result = CliRunner().invoke(command, ["--only", "streeming"])
    assert result.exit_code == 2
    assert "streaming" in result.output


@pytest.mark.nightly
def test_a_cached_start_is_quicker_than_a_cold_one():
    row = BENCHMARKS["start"]()
    assert row.more["cold_s"] > row.more["cached_s"]
