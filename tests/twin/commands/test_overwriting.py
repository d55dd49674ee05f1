"""Nothing that is there is touched without ``--overwrite``, whichever command writes and whichever option names it."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest
from recording_builders import write_run

from twin.cli import SUMMARIES, main

WRITING = {
    "acquire": ["--instruments", "none.toml", "--out", "new.mcap"],
    "check": ["run.mcap", "--recover", "new.mcap"],
    "convert": ["run.mcap", "new.uff"],
    "import": ["data.csv"],
    "identify": ["run.mcap", "--rig", "steel-lap-joint", "--out", "new.toml"],
    "modes": ["run.mcap"],
    "predict": ["steel-lap-joint", "--drive", "drive.csv", "--out", "new.csv"],
    "rehearse": ["steel-sweeps", "--rig", "steel-lap-joint", "--out", "new"],
    "replay": ["run.mcap", "--serial", "auto"],
    "rig": ["show", "steel-lap-joint"],
    "serve": ["--rig", "steel-lap-joint", "--serial", "auto"],
    "speed": ["--scaling"],
    "view": ["run.mcap"],
}
"""Commands with an option or argument that names a file to be written, and what they need besides."""
READ = {"run", "runs", "source", "instruments", "what", "loops", "drive", "held_out", "causes_files", "laws_files",
        "files", "mapping", "results", "measured"}  # fmt: skip
FOLDERS = {"campaign", "couple", "demo", "diagnose", "rehearse"}
"""Commands whose ``--out`` is a folder."""
SUFFIX = {"out": ".mcap", "target": ".uff", "save": ".rrd", "save_view": ".rrd", "picture": ".png"}


def command_of(name: str) -> click.Command:
    command: click.Command = importlib.import_module(f"twin.commands.{name}").command
    return next(iter(command.commands.values())) if isinstance(command, click.Group) else command


def written() -> Iterator[tuple[str, click.Parameter]]:
    """Every parameter of every command that names a file to be written."""
    for name in SUMMARIES:
        for parameter in command_of(name).params:
            is_folder = name in FOLDERS and parameter.name == "out"
            if isinstance(parameter.type, click.Path) and parameter.name not in READ and not is_folder:
                yield name, parameter


@pytest.mark.parametrize(("name", "parameter"), [pytest.param(n, p, id=f"{n} {p.name}") for n, p in written()])
def test_a_file_that_is_there_is_refused(
    name: str, parameter: click.Parameter, tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    monkeypatch.chdir(tmp_path)
    write_run(Path("run.mcap"), blocks=2)
    taken = Path(f"taken{SUFFIX.get(str(parameter.name), '.html')}")
    taken.write_bytes(b"precious")
    words = list(WRITING[name])
    if isinstance(parameter, click.Argument):
        words[-1] = str(taken)
    else:
        words += [max(parameter.opts, key=len), str(taken)]
    before = sorted(Path().iterdir())
    with pytest.raises(SystemExit) as ended:
        main([name, *words, "--quiet"])
    told = capsys.readouterr()
    assert ended.value.code == 2, told.err
    assert "exists already" in told.err
    assert taken.read_bytes() == b"precious"
    assert sorted(Path().iterdir()) == before


@pytest.mark.parametrize(
    "words",
    ["demo", "diagnose run.mcap --rig steel-lap-joint", "rehearse steel-sweeps --rig steel-lap-joint"],
    ids=lambda words: words.split()[0],
)
def test_a_folder_with_results_is_refused(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    write_run(Path("run.mcap"), blocks=2)
    Path("taken").mkdir()
    Path("taken/result.json").write_bytes(b"precious")
    with pytest.raises(SystemExit) as ended:
        main([*words.split(), "--out", "taken", "--quiet"])
    assert ended.value.code == 2
    assert "not empty" in capsys.readouterr().err
    assert [(path.name, path.read_bytes()) for path in Path("taken").iterdir()] == [("result.json", b"precious")]


def test_whoever_writes_can_be_told_to_overwrite() -> None:
    for name in {*WRITING, *FOLDERS} - {"campaign"}:  # which grows
        assert "overwrite" in {parameter.name for parameter in command_of(name).params}, name
