"""`twin couple` in a terminal: text, JSON, files; what is there stays; other commands say whose such a rig is."""

from __future__ import annotations

import json

import numpy as np
import pytest
from three_beams import STIFFNESS, files, rig_text

from recordings.responses import read_responses
from twin.cli import main


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    return files(tmp_path_factory.mktemp("beams"), np.random.default_rng(21))


def twin(capsys, *words):
    with pytest.raises(SystemExit) as ended:
        main([str(word) for word in words])
    told = capsys.readouterr()
    return ended.value.code, told.out, told.err


def test_joints_as_text_as_json_and_as_files(rig, tmp_path, capsys):
    out, measured = tmp_path / "out", rig.parent / "coupled.npz"
    status, printed, said = twin(capsys, "couple", rig, "--measured", measured, "--out", out)
    assert status == 0
    assert "bolt-1" in printed
    assert "with the identified ones" in said
    result = json.loads((out / "result.json").read_text())
    assert [joint["stiffness"]["value"] for joint in result["joints"]] == pytest.approx(STIFFNESS, rel=0.01)
    assert result["median_error"]["after"] < 0.002
    assert (out / "coupled.png").read_bytes().startswith(b"\x89PNG")
    one, other = (read_responses(out / f"coupled.{kind}").responses for kind in ("uff", "npz"))
    assert [each.response.name for each in one] == [each.response.name for each in other] == ["root", "tip"]
    assert pytest.approx(other[1].H) == one[1].H
    assert one[1].quantity == other[1].quantity == "acceleration"

    status, printed, said = twin(capsys, "couple", rig, "--out", out, "--json")
    assert (status, printed) == (2, "")
    assert "--overwrite" in said
    status, printed, _ = twin(capsys, "couple", rig, "--out", out, "--json", "--overwrite")
    assert status == 0
    assert "joints" not in json.loads(printed)
    assert json.loads(printed)["parts"][0]["rigid"] == 2


def test_what_is_wrong_leaves_nothing(rig, tmp_path, capsys):
    for words in ((rig, "--measured", rig), (tmp_path / "none.toml",), ("steel-lap-joint",)):
        status, printed, said = twin(capsys, "couple", *words, "--out", tmp_path / "out")
        assert (status, printed) == (2, "")
        assert len([line for line in said.splitlines() if line.startswith("twin:")]) == 1
        assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("words", [("rig", "show"), ("predict",)])
def test_other_commands_say_whose_such_a_rig_is(words, rig, capsys):
    more = ("--drive", "drive.csv", "--out", "out.csv") if words == ("predict",) else ()
    status, _, said = twin(capsys, *words, rig, *more)
    assert status == 2
    assert "known by its responses only" in said
    assert "'twin couple' predicts it" in said


def test_a_part_expanded_on_a_model_is_joined_where_nobody_measured(rig, tmp_path, capsys):
    """The middle beam has a model that is too long by a per cent; its bolts sit at points of that model."""
    text = rig_text().replace('responses = "b.npz"', f'responses = "{rig.parent / "b.npz"}"\n[measured_part.points]\n'
                              "b1 = 0.015\nb2 = 0.045\nb3 = 0.275\nb4 = 0.305")  # fmt: skip
    beam = text[text.index('[[part]]\nname = "c"') : text.index("[[measured_part]]")]
    text = text.replace(beam, beam + beam.replace('"c"', '"b"').replace("0.8200000000000001", "0.8632"))
    for number, at in enumerate((0.015, 0.045, 0.275, 0.305), 1):
        text = text.replace(f'"b{number}"', str(at))
    (tmp_path / "rig.toml").write_text(text)
    measured, out = rig.parent / "coupled.npz", tmp_path / "out"
    status, printed, said = twin(
        capsys, "couple", tmp_path / "rig.toml", "--measured", measured, "--out", out, "--json"
    )
    assert status == 0, said
    found = [joint["stiffness"]["value"] for joint in json.loads(printed)["joints"]]
    assert found == pytest.approx(STIFFNESS, rel=0.02)
