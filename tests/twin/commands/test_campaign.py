"""``twin campaign``: a clean rig through real processes, once, and then no more."""

from __future__ import annotations

import json
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager

import pytest
from small_rigs import rig_file

from twin.campaign import CaseResult, runner
from twin.cli import main


def run(arguments, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["campaign", *map(str, arguments)])
    return ended.value.code, capsys.readouterr()


def once_and_no_more(folder, capsys):
    """A clean rig's case is counted as right, and another campaign in its folder only counts it again."""
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


@contextmanager
def in_threads(workers, most):
    with ThreadPoolExecutor(workers) as executor:
        yield executor


def clean(plan, rig, keep, **options):
    """Stands for a diagnosis that finds nothing."""
    found = {"verdict": "none", "causes": [], "gain": None, "seconds": 1.0, "misfit": {"chi2_per_dof": 1.0}}
    return CaseResult(plan=plan, rig=rig.name, hidden=[], found=found, aborted=[], recording_s=0.0)


@pytest.mark.slow
def test_a_clean_rig_is_run_once_and_counted(tmp_path, capsys):
    once_and_no_more(tmp_path / "campaign", capsys)


def test_a_case_is_run_once_and_counted(tmp_path, capsys, monkeypatch):
    """With a stand-in for the diagnosis, in threads, which know of it."""

    monkeypatch.setattr(runner, "_executor", in_threads)
    monkeypatch.setattr(runner, "run_case", clean)
    once_and_no_more(tmp_path / "campaign", capsys)


def test_several_rigs_have_a_folder_each_and_one_table(tmp_path, capsys, monkeypatch):
    """A rig without a joint is given no slap, and that is told."""
    monkeypatch.setattr(runner, "_executor", in_threads)
    monkeypatch.setattr(runner, "run_case", clean)
    beam = rig_file("beam-hung", tmp_path)
    arguments = ["--rig", "l-frame", "--rig", beam, "--cause", "none", "--cause", "joint-slap", "--seeds", "2"]
    status, printed = run(["--out", tmp_path / "campaign", *arguments, "--json"], capsys)
    assert status == 0
    assert "beam-hung cannot have: joint-slap" in printed.err
    by_rig = json.loads(printed.out)["by_rig"]
    counted = {
        name: [(row["label"], row["cases"], row["outcomes"].get("right", 0)) for row in rows]
        for name, rows in by_rig.items()
    }
    assert counted == {"l-frame": [("joint-slap", 2, 0), ("none", 2, 2)], "beam-hung": [("none", 2, 2)]}
    assert len(list((tmp_path / "campaign" / "l-frame" / "cases").iterdir())) == 4
    run(["--out", tmp_path / "campaign", *arguments], capsys)


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
