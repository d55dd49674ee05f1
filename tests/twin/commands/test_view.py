"""``twin view``: from files and folders to an .rrd, without a screen."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parents[1] / "views"))  # runs for the views

from recorded_views import columns, sdof_run, verify, write_mcap

from twin.cli import main


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    return write_mcap(sdof_run(), tmp_path / "sweeps.mcap")


def call(*arguments: object) -> int:
    with pytest.raises(SystemExit) as ended:
        main(["view", *map(str, arguments)])
    return int(ended.value.code or 0)


def test_a_recording_becomes_a_view(recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "view.rrd"
    assert call(recording, "--save", out, "--json") == 0
    told = json.loads(capsys.readouterr().out)
    assert told == {"view": str(out), "bytes": out.stat().st_size, "opened": False}
    verify(out)
    assert "/sweeps/acc1/2N-up/steps" in columns(out)


def test_without_a_display_it_says_how_to_open_the_view(
    recording: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    if sys.platform in ("darwin", "win32"):
        pytest.skip("has a screen of its own")
    assert call(recording) == 0
    assert "no display here" in capsys.readouterr().err
    (view,) = tmp_path.glob("twin-view-*/sweeps.rrd")
    verify(view)


def test_a_folder_with_a_diagnosis_gives_its_own_view(recording: Path, tmp_path: Path) -> None:
    folder = tmp_path / "diagnosis"
    folder.mkdir()
    assert call(recording, "--save", folder / "view.rrd") == 0
    (folder / "result.json").write_text('{"verdict": "none"}')
    out = tmp_path / "copy.rrd"
    assert call(folder, "--save", out) == 0
    assert out.read_bytes() == (folder / "view.rrd").read_bytes()


def test_a_rehearsal_is_shown_with_its_warnings(recording: Path, tmp_path: Path) -> None:
    caution = {
        "kind": "jump-ahead",
        "index": 3,
        "frequency_Hz": 26.1,
        "steps": 1,
        "severity": "note",
        "sweep": "2N-up",
        "reason": "folds at 25 Hz",
        "advice": "go slow",
    }
    table = {"recording": recording.name, "steps": [], "branches": [], "warnings": [caution]}
    (tmp_path / "result.json").write_text(json.dumps(table))
    assert call(tmp_path, "--save", tmp_path / "out.rrd") == 0
    (text,) = columns(tmp_path / "out.rrd")["/about"]["TextDocument:text"][0]
    assert "folds at 25 Hz" in text


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ('{"recording": "../elsewhere.mcap", "steps": []}', "is not a file of"),
        ("[1, 2]", "no JSON object"),
        ("{", "not a result of this program"),
        ("[" * 100_000, "not a result of this program"),
    ],
)
def test_a_result_that_misleads_is_refused(
    content: str, reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "elsewhere.mcap").write_bytes(b"")
    folder = tmp_path / "folder"
    folder.mkdir()
    (folder / "result.json").write_text(content)
    assert call(folder, "--save", tmp_path / "out.rrd") == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert not (tmp_path / "out.rrd").exists()


def test_what_cannot_be_shown_is_told_in_one_line(
    recording: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    rubbish = tmp_path / "rubbish.mcap"
    rubbish.write_bytes(b"no recording at all")
    two = tmp_path / "two"
    two.mkdir()
    for name in ("a.mcap", "b.mcap"):
        (two / name).write_bytes(recording.read_bytes())
    out = tmp_path / "out.rrd"
    for what, reason in (
        (tmp_path / "missing.mcap", "no such file"),
        (empty, "neither a view nor a recording"),
        (rubbish, "rubbish.mcap"),
        (two, "name one of them: a.mcap, b.mcap"),
    ):
        assert call(what, "--save", out) == 2
        error = capsys.readouterr().err
        assert reason in error
        assert error.count("\n") == 1
    assert call(recording, "--save", tmp_path / "out.png") == 2
    assert "must end in .rrd" in capsys.readouterr().err
    assert not out.exists()
