"""``twin speed`` measures what it says, with errors small enough for its ratios to mean something."""

from __future__ import annotations

import json

from click.testing import CliRunner

from twin.commands.speed import command


def test_ratios_come_with_their_errors():
    result = CliRunner().invoke(command, ["--only", "streaming", "--only", "streaming-against-solve-ivp", "--json"])
    assert result.exit_code == 0
    rows = json.loads(result.stdout)
    for row in rows.values():
        assert set(row) >= {"ratio", "promise", "against", "error", "threads"}
        assert row["error"] < 1e-4
    # Far below the promises, so that a busy machine does not fail the test and a slow kernel does.
    assert rows["streaming"]["ratio"] > 20
    assert rows["streaming-against-solve-ivp"]["ratio"] > 100
