"""Manners of every command: help, --json, one line for bad input, exit status 2, nothing half-written."""

from __future__ import annotations

import errno
import importlib
import io
import os
import re
import shlex
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest
from needed import program
from rich.console import Console

from twin.cli import SUMMARIES, group, main
from twin.commands.common import output
from twin.commands.common.examples import EXAMPLES

RIG = ["--rig", "steel-lap-joint"]
BAD = {
    "demo": ["--cause", "gremlins", "--out", "out"],
    "rig": ["show", "missing.toml"],
    "rehearse": ["no-such-procedure", *RIG, "--out", "out"],
    "serve": ["--rig", "no-such-rig", "--serial", "auto", "--instruments-out", "out"],
    "acquire": ["steel-sweeps", "--instruments", "missing.toml", "--out", "out.mcap"],
    "replay": ["missing.mcap", "--serial", "auto"],
    "faults": ["--only", "gremlins"],
    "check": ["missing.mcap"],
    "import": ["missing.csv", "--out", "out.mcap"],
    "convert": ["missing.mcap", "out.csv"],
    "modes": ["missing.mcap", "--out", "out.csv"],
    "identify": ["missing.mcap", *RIG, "--out", "out.toml"],
    "friction": ["missing.csv"],
    "predict": ["missing.toml", "--drive", "missing.csv", "--out", "out.csv"],
    "couple": ["missing.toml", "--out", "out"],
    "diagnose": ["missing.mcap", *RIG, "--out", "out"],
    "campaign": ["--cause", "gremlins", "--out", "out"],
    "reproduce": ["no-such-paper"],
    "cite": ["missing.toml"],
    "view": ["missing.mcap", "--save", "out.rrd"],
    "speed": ["--no-such-option"],
}
RUBBISH = {
    "rig": ["show", "rubbish.toml"],
    "rehearse": ["rubbish.toml", *RIG, "--out", "out"],
    "serve": ["--rig", "rubbish.toml", "--serial", "auto", "--instruments-out", "out"],
    "acquire": ["steel-sweeps", "--instruments", "rubbish.toml", "--out", "out.mcap"],
    "replay": ["rubbish.mcap", "--serial", "auto"],
    "import": ["rubbish.csv", "--out", "out.mcap"],
    "convert": ["rubbish.mcap", "out.csv"],
    "modes": ["rubbish.mcap", "--out", "out.csv"],
    "identify": ["rubbish.mcap", *RIG, "--out", "out.toml"],
    "friction": ["rubbish.csv"],
    "predict": ["rubbish.toml", "--drive", "rubbish.csv", "--out", "out.csv"],
    "couple": ["rubbish.toml", "--out", "out"],
    "diagnose": ["rubbish.mcap", *RIG, "--out", "out"],
    "campaign": ["--rig", "rubbish.toml", "--out", "out"],
    "cite": ["rubbish.toml"],
    "view": ["rubbish.mcap", "--save", "out.rrd"],
}


def run(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main(list(arguments))
    return int(ended.value.code or 0)


def spoken(name: str) -> list[list[str]]:
    """The words that call a command, or each command of a group."""
    command = importlib.import_module(f"twin.commands.{name}").command
    return [[name, one] for one in command.commands] if isinstance(command, click.Group) else [[name]]


def test_a_bad_case_is_tried_for_every_command():
    assert list(BAD) == list(SUMMARIES)


def test_alone_it_tells_its_commands(capsys):
    assert run() == 0
    shown = capsys.readouterr()
    assert all(name in shown.out for name in SUMMARIES)
    assert shown.err == ""


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_command_helps_and_speaks_json(name, capsys):
    for words in spoken(name):
        assert run(*words, "--help") == 0
        shown = capsys.readouterr()
        assert "--json" in shown.out
        assert shown.err == ""


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_option_is_explained(name):
    whole = importlib.import_module(f"twin.commands.{name}").command
    for command in (whole, *whole.commands.values()) if isinstance(whole, click.Group) else (whole,):
        assert command.help
        silent = [p.name for p in command.params if isinstance(p, click.Option) and not p.help]
        assert silent == []


@pytest.mark.parametrize("name", SUMMARIES)
def test_every_example_is_a_command_line_that_is_understood(name, capsys):
    """Shown by the help, each on a line of its own; the command's own parser takes it."""
    assert run(name, "--help") == 0
    lines = capsys.readouterr().out.splitlines()
    command = group.get_command(click.Context(group), name)
    for example in EXAMPLES[name]:
        assert f"    {example}" in lines
        words = shlex.split(example)
        assert words[:2] == ["twin", name]
        command.make_context(name, words[2:], resilient_parsing="--commands" in words)


def test_no_help_shows_its_own_markup(capsys):
    """Click's mark for lines to be kept is a control character, which a raw docstring turns into text."""
    for name in SUMMARIES:
        assert run(name, "--help") == 0
        assert "\\b" not in capsys.readouterr().out


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


def test_unknown_commands_are_one_line_with_what_was_meant(capsys):
    assert run("rehears") == 2
    assert capsys.readouterr().err == "twin: no command 'rehears', perhaps rehearse; see 'twin --help'\n"


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_the_completion_script_is_one_for_that_shell(shell, capsys):
    if shell == "bash":
        program("bash")  # the script depends on its version
    assert run("--completion", shell) == 0
    assert "_TWIN_COMPLETE" in capsys.readouterr().out


def test_a_shell_completes_commands_options_shipped_names_and_files(installed_twin, tmp_path):
    def completed(words):
        environment = {
            "_TWIN_COMPLETE": "bash_complete", "COMP_WORDS": words, "COMP_CWORD": str(words.count(" ")),
            "PATH": os.environ["PATH"],
        }  # fmt: skip
        done = subprocess.run(
            [installed_twin], env=environment, cwd=tmp_path, capture_output=True, text=True, timeout=300, check=True
        )
        return done.stdout.split()

    assert completed("twin rep") == ["plain,replay", "plain,reproduce"]
    assert "plain,--held-out" in completed("twin diagnose --h")
    assert completed("twin rehearse steel-s") == ["plain,steel-sweeps", "file,steel-s"]
    assert "plain,steel-lap-joint" in completed("twin serve --rig steel")


def test_quiet_leaves_errors_only_and_lasts_for_one_command(tmp_path, capsys):
    table = tmp_path / "frequencies.csv"
    table.write_text("mode,frequency_Hz\n1,26.5\n2,157.6\n")
    assert run("check", str(table), "--quiet") == 0
    assert capsys.readouterr() == ("", "")
    assert run("check", str(table)) == 0
    assert "sound" in capsys.readouterr().err
    assert run("check", str(tmp_path / "none.csv"), "-q") == 2
    assert "none.csv" in capsys.readouterr().err


def test_verbose_says_what_was_done_when_and_where_an_error_came_from(tmp_path, capsys):
    (tmp_path / "rubbish.mcap").write_bytes(b"rubbish")
    assert run("check", str(tmp_path / "rubbish.mcap"), "--verbose") == 2
    shown = capsys.readouterr().err
    assert "0.0 s  checking rubbish.mcap" in shown
    assert "Traceback" in shown
    assert shown.splitlines()[-1].startswith("twin: ")


def test_work_of_unknown_length_tells_stage_and_time_and_no_estimate(monkeypatch):
    screen = Console(file=io.StringIO(), force_terminal=True, width=100)
    monkeypatch.setattr(output, "console", screen)
    with output.working("fitting") as say:
        say("scoring causes")
    shown = screen.file.getvalue()
    assert "scoring causes" in shown
    assert "0:00:00" in shown
    assert "left" not in shown


def test_counted_steps_tell_what_is_left_at_their_pace(monkeypatch):
    screen = Console(file=io.StringIO(), force_terminal=True, width=100, no_color=True)
    monkeypatch.setattr(output, "console", screen)
    with output.progress_bar() as bar:
        task = bar.add_task("sweeping", total=3)
        for _ in range(2):
            bar.advance(task)
            time.sleep(0.01)
        bar.refresh()
    assert re.search(r"about 0:00:0\d left", screen.file.getvalue())


@pytest.mark.parametrize("quiet", [False, True])
def test_a_pipe_gets_a_line_for_each_stage_that_lasts(monkeypatch, quiet):
    piped = Console(file=io.StringIO(), width=100, quiet=quiet)
    monkeypatch.setattr(output, "console", piped)
    monkeypatch.setattr(output, "_verbose", False)
    monkeypatch.setattr(output, "SAID_AFTER_s", 0.05)
    with output.working("reading") as say:
        time.sleep(0.1)
        say("over at once")
        say("scoring causes")
        time.sleep(0.1)
    told = [line.split(" s  ")[1] for line in piped.file.getvalue().splitlines()]
    assert told == ([] if quiet else ["reading", "scoring causes"])


def test_a_full_disk_is_one_line(monkeypatch, capsys):
    def full(**_):
        raise OSError(errno.ENOSPC, "No space left on device", "results/run.mcap")

    monkeypatch.setattr("twin.cli.group.main", full)
    monkeypatch.setattr(output, "_verbose", False)
    assert run("demo") == 2
    assert capsys.readouterr().err == "twin: results/run.mcap: no space left on device\n"


def test_the_module_is_the_command():
    done = subprocess.run(
        [sys.executable, "-m", "twin", "--help"],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
        cwd=Path("/"),
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
