"""Twenty-odd mistakes on every command: one line that names what is wrong, status 2, nothing left behind."""

from __future__ import annotations

import importlib
from collections.abc import Iterator
from pathlib import Path

import click
import pytest

from twin.cli import SUMMARIES, main
from twin.rigs.imported import EXAMPLE

GOOD = {
    "demo": ["--out", "new"],
    "rig show": ["steel-lap-joint", "--picture", "new.png"],
    "rig export": ["steel-lap-joint", "--mass", "new.mtx", "--stiffness", "new.npz", "--nodes", "new.csv"],
    "rig import": ["--mass", str(EXAMPLE / "beam.mas"), "--stiffness", str(EXAMPLE / "beam.sti"), "--out", "new.toml"],
    "rehearse": ["steel-sweeps", "--rig", "steel-lap-joint", "--out", "new"],
    "serve": ["--rig", "steel-lap-joint", "--serial", "auto", "--instruments-out", "new.toml"],
    "acquire": ["steel-sweeps", "--instruments", "instruments.toml", "--out", "new.mcap"],
    "faults": ["--only", "gremlins"],  # a good one would take long
    "replay": ["cut.mcap", "--serial", "auto"],
    "check": ["frequencies.csv"],
    "import": ["table.csv", "--out", "new.mcap"],
    "convert": ["cut.mcap", "new.uff"],
    "modes": ["cut.mcap"],
    "identify": ["cut.mcap", "--rig", "steel-lap-joint", "--out", "new.toml"],
    "friction": ["frequencies.csv"],
    "predict": ["steel-lap-joint", "--drive", "drive.csv", "--out", "new.csv"],
    "couple": ["steel-lap-joint", "--out", "new"],
    "diagnose": ["cut.mcap", "--rig", "steel-lap-joint", "--out", "new"],
    "campaign": ["--out", "new", "--seeds", "1", "--cause", "none"],
    "reproduce": ["composite-beam"],
    "cite": ["frequencies.csv"],
    "view": ["cut.mcap", "--save", "new.rrd"],
    "speed": [],
}
"""Command lines that would be understood, in the folder of `folder`."""
LONG = "x" * 5000
READ = {
    "files", "runs", "run", "results", "loops", "source", "what", "instruments", "drive", "held_out", "mass",
    "stiffness", "nodes", "measured",
}  # fmt: skip
"""Parameters that name files to be read."""
NAMES = {"procedure", "procedure_name", "rig", "rig_name", "model"}
"""Parameters that name something shipped, or a file."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Files that are what they should be, almost: empty, cut, binary, of another kind."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "empty").write_bytes(b"")
    for suffix in ("toml", "mcap", "csv", "uff", "mat", "blf", "rrd"):
        (tmp_path / f"empty.{suffix}").write_bytes(b"")
        (tmp_path / f"binary.{suffix}").write_bytes(bytes(range(256)) * 40)
        (tmp_path / f"text.{suffix}").write_text("Dear diary,\n\ttoday = nothing [was] measured\n")
    (tmp_path / "cut.mcap").write_bytes(b"\x89MCAP0\r\n" + bytes(60))
    (tmp_path / "frequencies.csv").write_text("mode,frequency_Hz\n1,26.5\n")
    (tmp_path / "table.csv").write_text("Time [s],Force [N]\n0.0,1.0\n0.1,2.0\n")
    (tmp_path / "drive.csv").write_text("frequency_Hz,force_N\n26.0,1.0\n")
    (tmp_path / "instruments.toml").write_text('[[device]]\nname = "daq"\naddress = "serial:/dev/none"\n')
    monkeypatch.chdir(tmp_path)
    return tmp_path


def mistakes(name: str) -> Iterator[list[str]]:
    """Command lines with one thing wrong each."""
    command = importlib.import_module(f"twin.commands.{name}").command
    if not isinstance(command, click.Group):
        yield from _mistakes(GOOD[name], command.params)
        return
    for word, one in command.commands.items():
        for words in _mistakes(GOOD[f"{name} {word}"], one.params):
            yield [word, *words]


def _mistakes(good: list[str], parameters: list[click.Parameter]) -> Iterator[list[str]]:
    yield [*good, "--no-such-option"]
    yield [*good, "--json=yes"]
    yield [*good, "--quiet", "one", "too", "many", LONG]
    for option in (p for p in parameters if isinstance(p, click.Option) and not p.is_flag):
        flag = max(option.opts, key=len)
        yield [*good, flag]
        for value in _bad_values(option):
            yield [*good, flag, value]
    arguments = [p for p in parameters if isinstance(p, click.Argument)]
    if arguments and arguments[0].required:
        yield good[1:]
        for value in _bad_values(arguments[0]):
            yield [value, *good[1:]]


def _bad_values(parameter: click.Parameter) -> list[str]:
    """What nobody could mean."""
    kind = parameter.type
    if isinstance(kind, click.Choice):
        return ["", "no-such", LONG]
    if isinstance(kind, (click.IntRange, click.FloatRange)):
        return ["", "abc", "-1e30", "1e30", "nan", "1,5", "½"]
    if parameter.name in READ or parameter.name in NAMES:
        files = [f"{what}.{suffix}" for what in ("empty", "binary", "text") for suffix in ("toml", "mcap", "csv")]
        return ["missing", "missing.mcap", "", "folder", "empty", "\x1b[31mred", LONG, "/dev/null", *files]
    if isinstance(kind, click.Path):
        return ["", "empty/below", "/proc/none", f"{LONG}.mcap"]
    if parameter.name in {"causes", "cause", "faults", "preload", "preloads", "speed", "tcp", "can"}:
        return ["no-such", "\x1b[31mred", LONG, ":::", "½=½"]
    return []


@pytest.mark.parametrize("name", SUMMARIES)
def test_no_mistake_shows_a_stack_trace_or_leaves_anything(
    name: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    before = sorted(folder.rglob("*"))
    tried = list(mistakes(name))
    assert len(tried) >= (3 if name in ("faults", "reproduce", "speed", "cite") else 20)  # those take hardly anything
    for arguments in tried:
        shown_as = [argument[:40] for argument in arguments]
        with pytest.raises(SystemExit) as ended:
            main([name, *arguments])
        shown = capsys.readouterr()
        assert ended.value.code == 2, (shown_as, shown.err[-500:])
        assert shown.out == "", shown_as
        assert len(shown.err.splitlines()) == 1, (shown_as, shown.err[-500:])
        assert shown.err.startswith("twin"), shown_as
        assert "\x1b" not in shown.err, shown_as
        assert sorted(folder.rglob("*")) == before, shown_as
