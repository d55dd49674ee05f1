"""`twin diagnose` as other programs call it: tables in, whole folders out, one line for anything wrong."""

import json
import os
import re
import signal
import subprocess
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from said import said_beside_stages

from recordings.staging import staged_folder
from twin.cli import main
from twin.commands.diagnose import command
from twin.lab.diagnosed_tables import DiagnosedTables
from twin.rigs import load_rig
from twin.rigs.store import load_any_rig

SWEEPS = Path(__file__).parents[2] / "data" / "brake-reuss" / "response_control.csv"
HEAD = "mode,frequency_Hz\n"
BEAM = HEAD + "1,253.1\n2,681.9\n3,1294.2\n4,2118.2\n"
SWEEP_HEAD = "level,frequency_Hz,force_N,acceleration_m_per_s2,phase_rad\n"


def run(capsys, *arguments):
    """Exit status, standard output and standard error."""
    with pytest.raises(SystemExit) as ended:
        main(["diagnose", *map(str, arguments)])
    captured = capsys.readouterr()
    return ended.value.code or 0, captured.out, captured.err


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A working folder with good and bad tables."""
    monkeypatch.chdir(tmp_path)
    held = [f"{k},{79 + 0.1 * i:.1f},1,{5 + i * (k == 2)},0\n" for k in range(6) for i in range(20)]
    files = {
        "beam.csv": BEAM,
        "two.csv": HEAD + "1,10\n2,20\n",
        "empty.csv": "",
        "nan.csv": HEAD + "1,10\n2,nan\n3,40\n",
        "negative.csv": HEAD + "1,10\n2,-20\n3,40\n",
        "half.csv": HEAD + "1,10\n1.5,20\n3,40\n",
        "falling.csv": HEAD + "1,10\n2,30\n3,20\n",
        "zero-std.csv": "mode,frequency_Hz,std_Hz\n1,10,1\n2,20,0\n3,40,1\n",
        "mode-99.csv": HEAD + "1,10\n2,20\n99,40\n",
        "preloads.csv": "preload,mode,frequency_Hz\n120N,1,26\n120N,2,158\n540N,1,26\n540N,2,159\n",
        "no-preload.csv": "preload,mode,frequency_Hz\n77N,1,26\n77N,2,158\n77N,3,470\n",
        "forced.csv": SWEEP_HEAD + "".join(held),
        "few.csv": SWEEP_HEAD + "".join(held[:40]),
        "long.csv": SWEEP_HEAD + "".join(f"{i % 10},{79 + i * 1e-4:.4f},1,5,0\n" for i in range(20_001)),
        "kind.toml": "kind = 5\n",
        "beam.toml": 'kind = "beam"\nname = "x"\n[beam]\nlength = -1\n',
        "empty.mcap": "",
    }
    for name, text in files.items():
        (tmp_path / name).write_text(text)
    (tmp_path / "rubbish.csv").write_bytes(bytes(range(256)) * 20)
    (tmp_path / "folder").mkdir()
    return tmp_path


COMPOSITE, STEEL, REUSS = (["--rig", name] for name in ("composite-beam", "steel-lap-joint", "brake-reuss"))
WRONG = {
    "empty": (["empty.csv", *COMPOSITE], "empty.csv"),
    "rubbish": (["rubbish.csv", *COMPOSITE], "rubbish.csv"),
    "missing": (["missing.csv", *COMPOSITE], "missing.csv"),
    "a folder": (["folder", *STEEL], "is a folder"),
    "mixed": (["beam.csv", "empty.mcap", *STEEL], "cannot be diagnosed together"),
    "mixed held out": (["beam.csv", "--held-out", "empty.mcap", *COMPOSITE], "cannot be diagnosed together"),
    "both kinds of table": (["beam.csv", str(SWEEPS), *COMPOSITE], "holds sweeps"),
    "an empty recording": (["empty.mcap", *STEEL], "empty.mcap"),
    "no such rig": (["beam.csv", "--rig", "gremlin"], "composite-beam"),
    "no rig file": (["beam.csv", "--rig", "gremlin.toml"], "gremlin.toml"),
    "a rig that is a folder": (["beam.csv", "--rig", "folder"], "folder"),
    "a rig of no kind": (["beam.csv", "--rig", "kind.toml"], "kind"),
    "an impossible beam": (["beam.csv", "--rig", "beam.toml"], "beam.width"),
    "a rig without structure": (["beam.csv", *REUSS], "natural frequencies need"),
    "a beam for recordings": (["empty.mcap", *COMPOSITE], "is a beam alone"),
    "preload of a beam": (["beam.csv", *COMPOSITE, "--preload", "120N"], "has no preloads"),
    "no such preload": (["beam.csv", *STEEL, "--preload", "nonsense"], "no preload nonsense"),
    "no such preload, recorded": (["empty.mcap", *STEEL, "--preload", "nonsense"], "nonsense"),
    "two preloads, recorded": (["empty.mcap", *STEEL, "--preload", "120N", "--preload", "540N"], "more than once"),
    "too many preloads": (["beam.csv", *STEEL, "--preload", "120N", "--preload", "540N"], "2 times for 1"),
    "a preload against the table": (["preloads.csv", *STEEL, "--preload", "120N"], "holds 540N"),
    "a preload twice": (["beam.csv", "two.csv", *STEEL], "120N is in beam.csv already"),
    "a preload the rig lacks": (["no-preload.csv", *STEEL], "line 2, column preload"),
    "preload of sweeps": ([str(SWEEPS), *REUSS, "--preload", "120N"], "--preload"),
    "not a number": (["nan.csv", *COMPOSITE], "line 3, column frequency_Hz"),
    "negative": (["negative.csv", *COMPOSITE], "line 3, column frequency_Hz"),
    "half a mode": (["half.csv", *COMPOSITE], "line 3, column mode"),
    "falling": (["falling.csv", *COMPOSITE], "line 4, column frequency_Hz"),
    "no uncertainty": (["zero-std.csv", *COMPOSITE], "line 3, column std_Hz"),
    "too few": (["two.csv", *COMPOSITE], "at least 3"),
    "beyond the mesh": (["mode-99.csv", *STEEL], "mode 99"),
    "sweeps of force": (["forced.csv", *REUSS], "sweep 2"),
    "few sweeps": (["few.csv", *REUSS], "at least five"),
    "too long": (["long.csv", *REUSS], "20001 steps"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_is_one_line_and_leaves_nothing(case, folder, capsys):
    arguments, told = WRONG[case]
    before = sorted(path.name for path in folder.iterdir())
    status, printed, said = run(capsys, *arguments, "--out", "out", "--json")
    assert (status, printed) == (2, "")
    refusal = [line for line in said.splitlines() if not re.match(r" +\d+\.\d s  ", line)]  # a stage that lasted
    assert len(refusal) == 1, said
    assert told in said
    assert sorted(path.name for path in folder.iterdir()) == before


@pytest.mark.parametrize("out", ["beam.csv", "beam.csv/deeper/out", "/dev/null/out"])
def test_a_place_that_cannot_hold_results_is_refused_before_the_work(out, folder, capsys, monkeypatch):
    def work(*_, **__):
        raise AssertionError("the work has begun")

    monkeypatch.setattr("twin.lab.load_rig", lambda name: SimpleNamespace(diagnose=work))
    status, _, said = run(capsys, "beam.csv", *COMPOSITE, "--out", out)
    assert status == 2
    assert len(said_beside_stages(said)) == 1
    assert out in said


def test_sweeps_become_a_folder_with_result_report_and_model(tmp_path, capsys):
    out = tmp_path / "deep" / "out"
    status, printed, _ = run(capsys, SWEEPS, *REUSS, "--out", out, "--json")
    data = json.loads(printed)
    assert data == json.loads((out / "result.json").read_text())
    assert (status, data["verdict"], data["explains"]) == (1, "unknown", False)
    assert data["gain"]["sweeps"] == ["1", "2", "3", "4", "5", "6"]
    assert {"misfit", "causes", "next_test", "extended_model", "seconds"} <= set(data)
    assert load_any_rig(out / data["extended_model"]).law is not None
    assert "shifted as a whole" in (out / "report.html").read_text()
    assert sorted(path.name for path in out.iterdir()) == ["extended.toml", "report.html", "result.json"]
    assert [path.name for path in tmp_path.iterdir()] == ["deep"]


def test_a_picture_that_cannot_be_drawn_loses_no_result(tmp_path, capsys, monkeypatch):
    def undrawn(*_, **__):
        raise ValueError("need at least one array to concatenate")

    monkeypatch.setattr(DiagnosedTables, "page", undrawn)
    status, printed, said = run(capsys, SWEEPS, *REUSS, "--out", tmp_path / "out", "--json")
    assert status == 1  # for what the sweeps leave unexplained
    assert json.loads(printed) == json.loads((tmp_path / "out" / "result.json").read_text())
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == ["extended.toml", "result.json"]
    assert "warning: report.html could not be drawn (need at least one array to concatenate)" in said
    assert "Traceback" not in said


@pytest.mark.slow
def test_frequencies_become_a_folder_whose_model_is_accepted_again(folder, capsys):
    (folder / "keep").mkdir()
    (folder / "keep" / "notes.txt").write_text("mine")
    status, printed, said = run(capsys, "beam.csv", *COMPOSITE, "--out", "keep")
    assert (status, printed) == (1, "")  # other causes would do
    assert "transverse-shear" in said
    data = json.loads((folder / "keep" / "result.json").read_text())
    assert data["causes"][0]["cause"] == "transverse-shear"
    assert data["causes"][0]["parameters"]["beam"] == "composite-beam"
    assert data["gain"]["held_out"]["after"] < data["gain"]["held_out"]["before"]
    assert "left out" in data["gain"]["how"]
    assert (folder / "keep" / "notes.txt").read_text() == "mine"
    (effect,) = load_any_rig(folder / "keep" / "extended.toml").effect
    assert effect.cause == "transverse-shear"
    report = (folder / "keep" / "report.html").read_text()
    assert "twin diagnose beam.csv --rig composite-beam --out keep" in report
    status, printed, _ = run(capsys, "beam.csv", "--rig", "keep/extended.toml", "--out", "again", "--json")
    assert (status, json.loads(printed)["verdict"]) == (0, "none")


def test_preloads_come_from_a_column_or_from_the_option(folder, capsys):
    """Too few frequencies of one preload, so that the tables are told apart before the work ends."""
    for name, preload in (("a.csv", "120N"), ("b.csv", "540N")):
        (folder / name).write_text(HEAD + "1,26\n")
        assert preload in load_rig("steel-lap-joint").joint.preload
    status, _, said = run(capsys, "a.csv", "b.csv", *STEEL, "--preload", "120N", "--preload", "540N", "--out", "out")
    assert (status, "holds 2 natural frequencies" in said) == (2, True)
    status, _, said = run(capsys, "a.csv", "b.csv", *STEEL, "--preload", "120N", "--out", "out")
    assert (status, "120N is in a.csv already" in said) == (2, True)


def test_identify_refuses_a_table_of_several_preloads(folder, capsys):
    with pytest.raises(SystemExit) as ended:
        main(["identify", "preloads.csv", *STEEL, "--out", "model.toml"])
    assert ended.value.code == 2
    assert "120N, 540N" in capsys.readouterr().err


def test_an_interruption_leaves_what_was_there(folder, installed_twin):
    (folder / "out").mkdir()
    (folder / "out" / "result.json").write_text("old")
    command = [installed_twin, "diagnose", "beam.csv", *COMPOSITE, "--out", "out", "--overwrite"]
    process = subprocess.Popen(command, stderr=subprocess.PIPE, cwd=folder, env={**os.environ, "PYTHONUNBUFFERED": "1"})
    deadline = time.monotonic() + 120
    while not list(folder.glob(".out.*")) and time.monotonic() < deadline:
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=120)
    assert process.returncode == 130
    assert b"Traceback" not in said
    assert [path.name for path in (folder / "out").iterdir()] == ["result.json"]
    assert (folder / "out" / "result.json").read_text() == "old"


def test_a_folder_of_results_appears_whole_or_not_at_all(tmp_path):
    out = tmp_path / "out"
    with pytest.raises(RuntimeError), staged_folder(out) as part:  # noqa: PT012
        (part / "result.json").write_text("half")
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []
    with staged_folder(out) as part:
        (part / "result.json").write_text("whole")
        assert not out.exists()
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    assert (out / "result.json").read_text() == "whole"


@pytest.mark.slow
def test_recordings_become_a_folder_too(campaign, tmp_path, capsys):
    out = tmp_path / "out"
    status, printed, _ = run(
        capsys, campaign / "random.mcap", campaign / "sweeps.mcap", "--held-out", campaign / "heldout.mcap", *STEEL,
        "--out", out, "--json",
    )  # fmt: skip
    data = json.loads(printed)
    assert status == 0
    assert data["verdict"] in ("none", "explained")
    assert data == json.loads((out / "result.json").read_text())
    assert {"extended.toml", "report.html", "result.json", "view.rrd"} <= {path.name for path in out.iterdir()}
    assert [path.name for path in tmp_path.iterdir()] == ["out"]


@pytest.mark.parametrize(
    ("words", "runs", "held"),
    [
        ("a.mcap b.mcap --held-out c.mcap d.mcap --rig x --out y", "ab", "cd"),
        ("a.mcap --held-out c.mcap --rig x b.mcap --out y", "ab", "c"),
        ("a.mcap b.mcap --rig x --out y --held-out c.mcap --held-out d.mcap", "ab", "cd"),
        ("a.mcap --held-out=c.mcap b.mcap --rig x --out y", "ab", "c"),
    ],
)
def test_all_words_after_held_out_are_held_out(words, runs, held):
    """None of them is learnt from, as the contract's ``[--held-out RUN...]`` says."""
    found = command.make_context("diagnose", words.split()).params
    assert found["runs"] == tuple(Path(f"{name}.mcap") for name in runs)
    assert found["held_out"] == tuple(Path(f"{name}.mcap") for name in held)
