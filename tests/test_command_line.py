"""Manners of every command: help, --json, one line for bad input, exit status 2, nothing half-written."""

from __future__ import annotations

import importlib
import subprocess
import sys
from pathlib import Path

import click
import pytest

from twin.cli import SUMMARIES, main

RIG = ["--rig", "steel-lap-joint"]
BAD = {
    "demo": ["--cause", "gremlins", "--out", "out"],
    "rehearse": ["no-such-procedure", *RIG, "--out", "out"],
    "serve": ["--rig", "no-such-rig", "--serial", "auto", "--instruments-out", "out"],
    "acquire": ["steel-sweeps", "--instruments", "missing.toml", "--out", "out.mcap"],
    "replay": ["missing.mcap", "--serial", "auto"],
    "check": ["missing.mcap"],
    "convert": ["missing.mcap", "out.csv"],
    "identify": ["missing.mcap", *RIG, "--out", "out.toml"],
    "predict": ["missing.toml", "--drive", "missing.csv", "--out", "out.csv"],
    "diagnose": ["missing.mcap", *RIG, "--out", "out"],
    "campaign": ["--cause", "gremlins", "--out", "out"],
    "reproduce": ["no-such-paper"],
    "view": ["missing.mcap", "--save", "out.rrd"],
    "speed": ["--no-such-option"],
}
RUBBISH = {
    "rehearse": ["rubbish.toml", *RIG, "--out", "out"],
    "serve": ["--rig", "rubbish.toml", "--serial", "auto", "--instruments-out", "out"],
    "acquire": ["steel-sweeps", "--instruments", "rubbish.toml", "--out", "out.mcap"],
    "replay": ["rubbish.mcap", "--serial", "auto"],
    "convert": ["rubbish.mcap", "out.csv"],
    "identify": ["rubbish.mcap", *RIG, "--out", "out.toml"],
    "predict": ["rubbish.toml", "--drive", "rubbish.csv", "--out", "out.csv"],
    "diagnose": ["rubbish.mcap", *RIG, "--out", "out"],
    "campaign": ["--rig", "rubbish.toml", "--out", "out"],
    "view": ["rubbish.mcap", "--save", "out.rrd"],
}


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return int(ended.value.code or 0)


def test_a_bad_case_is_tried_for_every_command():
    assert list(BAD) == list(SUMMARIES)


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_command_helps_and_speaks_json(name, capsys):
    assert run(name, "--help") == 0
    shown = capsys.readouterr()
    assert "--json" in shown.out
    assert shown.err == ""


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_option_is_explained(name):
    command = importlib.import_module(f"twin.commands.{name}").command
    assert command.help
    silent = [p.name for p in command.params if isinstance(p, click.Option) and not p.help]
    assert silent == []


@pytest.mark.parametrize("name", BAD)
def test_bad_usage_is_one_line_and_leaves_nothing(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    assert run(name, *BAD[name], "--json") == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.strip().splitlines()) == 1, shown.err
    wrong = next(word for word in BAD[name] if word.startswith(("missing", "no-such", "--no-such", "gremlins")))
    assert wrong in shown.err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("name", RUBBISH)
def test_rubbish_in_files_is_one_line_and_leaves_nothing(name, tmp_path, monkeypatch, capsys):
    for suffix in ("toml", "mcap", "csv"):
        (tmp_path / f"rubbish.{suffix}").write_bytes(b"\x89\x00 = [[[\xff" * 7)
    before = sorted(tmp_path.iterdir())
    monkeypatch.chdir(tmp_path)
    assert run(name, *RUBBISH[name], "--json") == 2
    shown = capsys.readouterr()
    assert shown.out == ""
    assert len(shown.err.strip().splitlines()) == 1, shown.err
    assert "rubbish." in shown.err
    assert sorted(tmp_path.iterdir()) == before


def test_a_full_folder_is_not_written_into(tmp_path, capsys):
    (tmp_path / "thesis.txt").write_text("mine")
    assert run("demo", "--out", str(tmp_path)) == 2
    assert "not empty" in capsys.readouterr().err
    assert [path.name for path in tmp_path.iterdir()] == ["thesis.txt"]


def test_the_version_tells_what_results_depend_on(capsys):
    assert run("--version") == 0
    shown = capsys.readouterr().out
    assert shown.startswith("twin ")
    assert all(name in shown for name in ("Python", "numpy", "scipy", "numba", "rerun-sdk"))


def test_unknown_commands_are_one_line(capsys):
    assert run("dance") == 2
    assert len(capsys.readouterr().err.strip().splitlines()) == 1


def test_the_module_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "twin", "--help"], capture_output=True, text=True, timeout=60, check=False, cwd=Path("/")
    )
    assert done.returncode == 0
    assert all(name in done.stdout for name in SUMMARIES)


def test_an_interruption_while_a_compiled_module_loads_is_no_failure(monkeypatch, capsys):
    def interrupted(**_):
        raise ImportError("initialization failed") from KeyboardInterrupt()

    monkeypatch.setattr("twin.cli.group.main", interrupted)
    assert run("speed") == 130
    assert capsys.readouterr().err == "twin: interrupted\n"


def test_a_module_that_is_missing_is_a_failure(monkeypatch):
    def missing(**_):
        raise ImportError("no module named numpy")

    monkeypatch.setattr("twin.cli.group.main", missing)
    with pytest.raises(ImportError, match="numpy"):
        main(["speed"])
