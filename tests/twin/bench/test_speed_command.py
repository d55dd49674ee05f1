"""``twin speed`` measures what it says, with errors small enough for its ratios to mean something."""

from __future__ import annotations

import json

import pytest
from click.testing import CliRunner

from twin.commands.speed import command


@pytest.fixture(scope="module")
def rows():
    result = CliRunner().invoke(command, ["--only", "streaming", "--json"])
    assert result.exit_code == 0
    return json.loads(result.stdout)


def test_ratios_come_with_their_errors(rows):
    for row in rows.values():
        assert set(row) >= {"ratio", "promise", "against", "error", "threads"}
        assert row["error"] < 1e-4
        assert row["ratio"] > 0


@pytest.mark.nightly
def test_no_kernel_is_slow_by_an_order(rows):
    """Far below the promises, so that a busy machine does not fail the test."""
    assert rows["streaming"]["ratio"] > 20
