"""`twin identify` writes its report beside the model; both files appear, or neither."""

import json

import pytest
from said import said_beside_stages

from twin.cli import main
from twin.lab import identified_moduli

TABLE = "mode,frequency_Hz\n1,26.50\n2,157.60\n3,471.80\n"
STEEL = ["--rig", "steel-lap-joint", "--preload", "120N"]


def run(capsys, *arguments):
    """Exit status, standard output and standard error."""
    with pytest.raises(SystemExit) as ended:
        main(["identify", *map(str, arguments)])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with a table of natural frequencies."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "f.csv").write_text(TABLE)
    return tmp_path


def names(folder):
    return sorted(path.name for path in folder.iterdir())


def test_the_report_lies_beside_the_model_and_says_how_to_get_it_again(folder, capsys):
    status, printed, said = run(capsys, "f.csv", *STEEL, "--out", "model.toml", "--json")
    result = json.loads(printed)
    assert status == 0
    assert (result["model"], result["report"]) == ("model.toml", "model.html")
    assert names(folder) == ["f.csv", "model.html", "model.toml"]
    page = (folder / "model.html").read_text()
    assert "twin identify f.csv --rig steel-lap-joint --preload 120N --out model.toml" in page
    assert "natural frequencies within" in page
    assert "report in model.html" in said


def test_the_report_can_lie_elsewhere_or_nowhere(folder, capsys):
    (folder / "pages").mkdir()
    assert run(capsys, "f.csv", *STEEL, "--out", "model.toml", "--report", "pages/joint.html")[0] == 0
    assert names(folder) == ["f.csv", "model.toml", "pages"]
    assert names(folder / "pages") == ["joint.html"]
    status, printed, _ = run(capsys, "f.csv", *STEEL, "--out", "again.toml", "--no-report", "--json")
    assert (status, json.loads(printed)["report"]) == (0, None)
    assert names(folder) == ["again.toml", "f.csv", "model.toml", "pages"]


@pytest.mark.parametrize(
    ("places", "told"),
    [
        (["--out", "model.html"], "is the report's name too"),
        (["--out", "model.toml", "--report", "nowhere/page.html"], "its folder does not exist"),
        (["--out", "model.toml", "--report", "pages"], "is a folder"),
        (["--out", "pages"], "is a folder"),
    ],
)
def test_places_that_cannot_be_are_refused_before_the_work(folder, capsys, monkeypatch, places, told):
    (folder / "pages").mkdir()
    monkeypatch.setattr(identified_moduli, "fit_moduli", lambda *_, **__: pytest.fail("it went to work"))
    status, printed, said = run(capsys, "f.csv", *STEEL, *places, "--json")
    assert (status, printed) == (2, "")
    assert told in said
    assert len(said_beside_stages(said)) == 1
    assert names(folder) == ["f.csv", "pages"]


def test_a_report_that_fails_leaves_no_model(folder, capsys, monkeypatch):
    def full_disk(*_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(identified_moduli.IdentifiedModuli, "page", full_disk)
    status, _, said = run(capsys, "f.csv", *STEEL, "--out", "model.toml")
    assert status == 2
    assert "no space left on device" in said
    assert names(folder) == ["f.csv"]
