"""Every shipped rig, and rigs without joints, of beams and by matrices, through every command, printed and as JSON."""

import json
import re

import pytest
from small_rigs import DRAWN, HIDDEN, rig_file, write_procedures

import twin
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
    assert " ".join(found["answer"].split()) in " ".join(said.split())
    if hidden and name in CHEAP:
        assert "added-mass" in [cause["cause"] for cause in found["causes"]]
    sensible(out / "report.html", load_rig(rig_path))
    run(capsys, "rig", "show", out / "extended.toml")


MODES = {"two-lap-joints": 6, "l-frame": 5, "hung-lap-joint": 5, **dict.fromkeys(WITHOUT_JOINT, 5)}


@pytest.fixture
def frequencies(tmp_path):
    """A rig's file and a table of its own natural frequencies with all stiffnesses a tenth lower, to 0.05 %."""

    def of(name):
        path, table = rig_file(name, tmp_path), tmp_path / "frequencies.csv"
        found = modelled_rig(load_rig(path)).modes.frequency_Hz
        found = found[found > 1.0][: MODES[name]] * 0.9**0.5
        rows = [f"{n},{f:.6g},{5e-4 * f:.3g}" for n, f in enumerate(found, 1)]
        table.write_text("\n".join(["mode,frequency_Hz,std_Hz", *rows, ""]))
        return path, table

    return of


@pytest.mark.parametrize("name", MODES)
def test_natural_frequencies_alone_give_moduli_or_say_that_there_are_none(name, frequencies, capsys, tmp_path):
    path, table = frequencies(name)
    rig, model = load_rig(path), tmp_path / "model.toml"
    if "matrices" in name:
        with pytest.raises(SystemExit) as ended:
            main(["identify", str(table), "--rig", str(path), "--out", str(model)])
        assert ended.value.code == 2
        assert f"{path}: has neither a joint nor a beam" in capsys.readouterr().err
        return
    _, found = both(capsys, "identify", table, "--rig", path, "--out", model)
    assert set(found["linear"]) == ({"normal_modulus", "shear_modulus"} if rig.joints else {"youngs_modulus"})
    if len(rig.joints) > 1:
        assert found["joints"] == [joint.name for joint in rig.joints]
        assert len(found["linear"]["normal_modulus"]) == len(rig.joints)
    if not rig.joints:
        assert found["linear"]["youngs_modulus"]["value"] == pytest.approx(0.9 * rig.part[0].youngs_modulus, rel=1e-3)
        assert max(abs(error) for error in found["residual_percent"].values()) < 0.01
    sensible(tmp_path / "model.html", rig)
    assert load_rig(model).name == rig.name


@pytest.mark.parametrize(
    "name", [name if name in WITHOUT_JOINT else pytest.param(name, marks=pytest.mark.slow) for name in MODES]
)
def test_natural_frequencies_alone_are_diagnosed(name, frequencies, capsys, tmp_path):
    path, table = frequencies(name)
    out = tmp_path / "out"
    words = ["diagnose", str(table), "--rig", str(path), "--out", str(out)]
    with pytest.raises(SystemExit) as ended:
        main(words)
    said, found = capsys.readouterr().err, json.loads((out / "result.json").read_text())
    assert ended.value.code == int(not found["explains"])
    assert "Traceback" not in said
    assert " ".join(found["answer"].split()) in " ".join(said.split())
    assert {"set_95", "excluded", "model_error", "identified", "tried"} <= set(found)
    if name == "beam-clamped":
        assert found["verdict"] == "none"
    sensible(out / "report.html", load_rig(path))
    assert twin.load_rig(path).diagnose(table).verdict == found["verdict"]
    run(capsys, "rig", "show", out / "extended.toml")
