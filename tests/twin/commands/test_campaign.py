"""``twin campaign``: a clean rig through real processes, once, and then no more."""

from __future__ import annotations

import json

import pytest

from twin.cli import main


def run(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["campaign", *map(str, arguments)])
    return ended.value.code, capsys.readouterr()


def test_a_clean_rig_is_run_once_and_counted(tmp_path, capsys):
    folder = tmp_path / "campaign"
    arguments = ["--out", folder, "--cause", "none", "--seeds", "1", "--first-seed", "21", "--json"]
    status, printed = run(arguments, capsys)
    assert status == 0
    (row,) = json.loads(printed.out)["rows"]
    assert (row["label"], row["cases"], row["outcomes"]) == ("none", 1, {"right": 1})
    assert json.loads((folder / "campaign.json").read_text()) == json.loads(printed.out)
    assert (folder / "confusion.png").read_bytes().startswith(b"\x89PNG")
    case = folder / "cases" / "none-1-21.json"
    written = case.stat().st_mtime_ns
    status, again = run(arguments, capsys)
    assert (status, again.out) == (0, printed.out)
    assert case.stat().st_mtime_ns == written
    assert "none-1-21: right" in again.err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--cause", "gremlin"], "--cause: no cause 'gremlin'; one of "),
        (["--cause", "added-mass", "--pairs", "2"], "--pairs: needs two causes"),
        (["--rig", "nowhere.toml"], "nowhere.toml: no such file"),
        (["--scheduler", "nonsense://"], "--scheduler"),
        (["--strength", "0"], "--strength"),
    ],
)
def test_a_mistake_is_one_line_and_leaves_nothing(tmp_path, capsys, arguments, message):
    status, printed = run(["--out", tmp_path / "campaign", *arguments], capsys)
    assert status == 2
    assert message in printed.err
    assert printed.err.count("\n") == 1
    assert not (tmp_path / "campaign").exists()
