"""Names that strangers wrote never steer the terminal: not in errors, not in remarks, not in a bar."""

from __future__ import annotations

import io
from pathlib import Path

import pytest
from rich.console import Console

from recordings import InputError
from twin.cli import main
from twin.commands.common import output
from twin.rigs import RIG_FILES

STEERING = "\x1b]0;owned\x07\x1b[2J\u202e"


def harmless(text: str) -> bool:
    return all(c.isprintable() or c == "\n" for c in text)


def test_errors() -> None:
    assert harmless(str(InputError(f"a{STEERING}", f"b{STEERING}", f"c{STEERING}", STEERING)))


@pytest.mark.parametrize("where", ["key", "option", "file"])
def test_commands(where: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "rig.toml"
    path.write_text('"a\\u001b]0;owned\\u0007" = 1\n' + RIG_FILES["steel-lap-joint"].read_text())
    names = {"key": str(path), "option": f"--{STEERING}", "file": str(tmp_path / f"{STEERING}.toml")}
    with pytest.raises(SystemExit) as ended:
        main(["rig", "show", names[where]])
    assert ended.value.code == 2
    shown = capsys.readouterr()
    assert "owned" in shown.err
    assert harmless(shown.err)


def test_bars(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn = io.StringIO()
    monkeypatch.setattr(output, "console", Console(file=drawn, force_terminal=True, width=120))
    with output.progress_bar() as bar:
        bar.add_task(f"reading {STEERING}", total=None)
    assert "reading" in drawn.getvalue()
    assert "\x07" not in drawn.getvalue()
    assert "\u202e" not in drawn.getvalue()
