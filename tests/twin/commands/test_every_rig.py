"""Every shipped rig, and rigs without joints, of beams and by matrices, through every command, printed and as JSON."""

import json
import re

import pytest
from small_rigs import DRAWN, HIDDEN, rig_file, write_procedures

from twin.cli import main
from twin.rigs import RIG_FILES, load_rig
from twin.structure.modelled_rig import modelled_rig

RIGS = [*RIG_FILES, *DRAWN]
CHEAP = ("beam-clamped", "matrices-clamped")
"""Rigs whose diagnosis takes half a minute at most; that of others takes minutes, and is ended."""
ENDED_s = 20
"""After which fits end where they are: every row is to take less than a minute of one core."""
WITHOUT_JOINT = tuple(name for name in DRAWN if name != "bars-in-space")
QUICK = (*WITHOUT_JOINT, "hybrid-joint", "steel-lap-joint")
"""Rigs that are rehearsed and identified in 10 to 15 s; the others take 35 to 60 s, the plate 105 s."""
OF_CANTILEVERS = re.compile(r"\btip\b|from the clamp|the overlap")


def slow_unless(quick):
    return [name if name in quick else pytest.param(name, marks=pytest.mark.slow) for name in RIGS]


def run(capsys, *words, ends=(None, 0)):
    """Standard output and standard error of a command that must end well, without a stack trace."""
    with pytest.raises(SystemExit) as ended:
        main([*map(str, words)])
    captured = capsys.readouterr()
    assert ended.value.code in ends, captured.err
    assert "Traceback" not in captured.err
    return captured.out, captured.err


def both(capsys, *words):
    """What a command that writes says to a person, and its JSON object."""
    said = run(capsys, *words)[1]
    return said, json.loads(run(capsys, *words, "--overwrite", "--json")[0])


@pytest.fixture(scope="module")
def rehearsed(tmp_path_factory):
    """Folder with a rig's file and its rehearsed noise and sweep, a mass on the rig if it is to be hidden there."""
    known = {}

    def of(capsys, name, *, hidden):
        if (name, hidden) not in known:
            folder = tmp_path_factory.mktemp(name)
            nominal = rig_file(name, folder)
            first_Hz = modelled_rig(load_rig(nominal)).modes.frequency_Hz[0]
            inside = folder / "hidden"
            inside.mkdir()
            effect = {"cause": "added-mass", "parameters": HIDDEN[name]} if hidden else None
            true = rig_file(name, inside, effect=effect)
            for procedure in write_procedures(folder, first_Hz):
                out = folder / procedure.stem
                told = run(capsys, "rehearse", procedure, "--rig", true, "--rounds", 0, "--out", out, "--json")[0]
                assert json.loads(told)["steps"]
            known[name, hidden] = folder
        return known[name, hidden]

    return of


def runs_of(folder):
    return [folder / name / "run.mcap" for name in ("random", "sweep")]


def sensible(path, rig):
    """A report that says of a rig only what it has."""
    text = re.sub(r"<[^>]*>|data:\S+", " ", path.read_text())
    assert not OF_CANTILEVERS.search(text), OF_CANTILEVERS.search(text)
    if not rig.layout().supports:
        assert "clamp" not in text
    if not rig.joints:
        assert "bolted" not in text
        assert "preload ;" not in text


@pytest.mark.parametrize("name", slow_unless(QUICK))
def test_a_rig_is_shown_rehearsed_identified_and_predicted(name, rehearsed, capsys, tmp_path):
    folder = rehearsed(capsys, name, hidden=False)
    rig_path, model = folder / f"{name}.toml", tmp_path / "model.toml"
    said, shown = both(
        capsys, "rig", "show", rig_path, "--picture", tmp_path / "rig.png", "--save", tmp_path / "rig.rrd"
    )
    rig = load_rig(rig_path)
    assert shown["joints"] == [joint.name for joint in rig.joints]
    assert "mode 1:" in said
    words = ("identify", *runs_of(folder), "--rig", rig_path, "--out", model)
    found = both(capsys, *words)[1] if name in QUICK else json.loads(run(capsys, *words, "--json")[0])
    assert len(found["linear"]["modal_damping"]) > 1
    assert bool(found["linear"]["normal_modulus"]) == bool(rig.joints)
    sensible(tmp_path / "model.html", rig)
    (tmp_path / "drive.csv").write_text("frequency_Hz,force_N\n50.0,0.1\n60.0,0.1\n")
    drive = ("--drive", tmp_path / "drive.csv", "--out", tmp_path / "response.csv")
    assert json.loads(run(capsys, "predict", model, *drive, "--json")[0])["rows"] >= 2
    run(capsys, "view", folder / "sweep", "--save", tmp_path / "sweep.rrd")
    assert {path.name for path in tmp_path.iterdir()} - {".twin-cache"} == {
        "rig.png", "rig.rrd", "model.toml", "model.html", "drive.csv", "response.csv", "sweep.rrd",
    }  # fmt: skip


@pytest.mark.parametrize("hidden", [False, True], ids=["clean", "with-a-mass"])
@pytest.mark.parametrize("name", slow_unless(CHEAP))
def test_a_rig_is_diagnosed(name, hidden, rehearsed, capsys, tmp_path):
    folder = rehearsed(capsys, name, hidden=hidden)
    rig_path, out = folder / f"{name}.toml", tmp_path / "out"
    # One that was ended early may have no answer yet.
    limit, ends = ((), (None, 0)) if name in CHEAP else (("--time-limit", ENDED_s), (None, 0, 1))
    _, said = run(capsys, "diagnose", *runs_of(folder), "--rig", rig_path, "--out", out, *limit, ends=ends)
    found = json.loads((out / "result.json").read_text())
    assert {"result.json", "extended.toml", "report.html", "view.rrd"} <= {path.name for path in out.iterdir()}
    assert "could not be drawn" not in said
    assert found["answer"] in " ".join(said.split())
    if hidden and name in CHEAP:
        assert "added-mass" in [cause["cause"] for cause in found["causes"]]
    sensible(out / "report.html", load_rig(rig_path))
    run(capsys, "rig", "show", out / "extended.toml")


@pytest.mark.parametrize("name", ["two-lap-joints", "l-frame", *WITHOUT_JOINT])
@pytest.mark.parametrize("command", ["identify", "diagnose"])
def test_natural_frequencies_alone_are_for_rigs_of_one_joint(name, command, capsys, tmp_path):
    path, table = rig_file(name, tmp_path), tmp_path / "frequencies.csv"
    table.write_text("mode,frequency_Hz\n1,20\n2,100\n3,300\n")
    with pytest.raises(SystemExit) as ended:
        main([command, str(table), "--rig", str(path), "--out", str(tmp_path / "out")])
    said = capsys.readouterr().err
    assert ended.value.code == 2
    assert said.count("\n") == 1
    assert f"{path}: joint: it has {'2 joints' if 'bar' not in path.read_text() else 'no joint'}" in said
