"""`twin rig import`: from another program's files to a rig that is shown."""

import json
import shutil

import numpy as np
import pytest

from recordings.errors import InputError
from twin.cli import group
from twin.rigs import RIG_FILES, load_rig
from twin.rigs.imported import EXAMPLE
from twin.rigs.layout import MatricesPart
from twin.structure.modelled_rig import modelled_rig

BEAM = ("--mass", EXAMPLE / "beam.mas", "--stiffness", EXAMPLE / "beam.sti")
PLATE = RIG_FILES["stiffened-plate"].with_suffix("")


def imported(capsys, *arguments):
    group.main(
        args=["rig", "import", *map(str, arguments), "--json"], prog_name="twin", standalone_mode=False
    )  # fmt: skip
    return json.loads(capsys.readouterr().out)


def test_a_calculix_model_has_its_own_natural_frequencies(capsys, tmp_path):
    out = tmp_path / "beam.toml"
    found = imported(capsys, *BEAM, "--drive", "0.04,0.004,0:+y", "--sensor", "tip=0.16,0.004,0:+y", "--out", out)
    (part,) = found["parts"]
    assert part["units"] == "mm-t-s"
    assert part["mass_kg"] == pytest.approx(0.06656, rel=1e-3)
    assert part["size_m"] == pytest.approx([0.12, 0.004, 0.016])
    assert found["drive"] == {"part": "part", "node": 7, "direction": "+y"}
    assert found["sensors"] == [{"channel": "tip", "part": "part", "node": 19, "direction": "+y"}]
    assert sorted(map(str, tmp_path.iterdir())) == sorted(found["files"])
    text = out.read_text()
    assert text.count("check:") > 12
    bare = tmp_path / "bare.toml"
    bare.write_text(text.replace("mass = 0.002 ", "mass = 0.0 "))
    frequencies = modelled_rig(load_rig(bare)).modes.frequency_Hz
    np.testing.assert_allclose(frequencies[:3], [135.9155, 533.8358, 919.1058], rtol=1e-6)


def test_two_parts_are_joined_where_their_nodes_face_each_other(capsys, tmp_path):
    out = tmp_path / "plate.toml"
    files = [
        argument
        for name, end in (("plate", "npz"), ("stiffener", "mtx"))
        for argument in ("--part", name, "--mass", f"{PLATE}/{name}-mass.{end}",
                         "--stiffness", f"{PLATE}/{name}-stiffness.{end}", "--nodes", f"{PLATE}/{name}-nodes.csv")
    ]  # fmt: skip
    found = imported(capsys, *files, "--drive", "plate/5:+z", "--support", "plate/1:x,y", "--out", out)
    assert found["joints"] == [{"name": "plate-stiffener", "pairs": 27}]
    assert found["supports"] == [{"part": "plate", "node": 1, "fix": ["x", "y"]}]
    rig, shipped = load_rig(out), load_rig("stiffened-plate")
    assert [part.name for part in rig.part if isinstance(part, MatricesPart)] == ["plate", "stiffener"]
    moduli = shipped.joint[0].preload["4Nm"]
    joint = rig.joint[0].model_copy(update={"preload": {"nominal": moduli}})
    free = rig.model_copy(update={"joint": [joint], "support": [], "sensor": rig.sensor[:1]}).in_folder(tmp_path)
    bare = shipped.model_copy(update={"sensor": shipped.sensor[:1]}).in_folder(PLATE.parent)
    ours, theirs = (modelled_rig(one).modes.frequency_Hz[:6] for one in (free, bare))
    np.testing.assert_allclose(ours, theirs, rtol=0.025)  # the areas differ: triangles here, Simpson's rule there


def test_a_soft_place_is_driven_and_nodes_without_places_are_told(capsys, tmp_path):
    for name in ("beam.mas", "beam.sti", "beam.dof"):
        shutil.copy(EXAMPLE / name, tmp_path)
    files = ("--mass", tmp_path / "beam.mas", "--stiffness", tmp_path / "beam.sti", "--out", tmp_path / "rig.toml")
    with pytest.raises(
        InputError, match="its units cannot be guessed from its size and its speed of sound; say --units"
    ):
        imported(capsys, *files)
    found = imported(capsys, *files, "--units", "mm-t-s")
    assert any("no table of nodes" in note for note in found["parts"][0]["notes"])
    assert found["sensors"][0]["node"] == found["drive"]["node"]
    assert modelled_rig(load_rig(tmp_path / "rig.toml")).modes.frequency_Hz[0] == pytest.approx(135.9, rel=0.05)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("--mass", EXAMPLE / "beam.sti", "--stiffness", EXAMPLE / "beam.sti"), "is a stiffness of CalculiX"),
        ((*BEAM, "--drive", "0,0,0:y"), "--drive: '0,0,0:y' ends in no direction"),
        ((*BEAM, "--drive", "0,0:+y"), "--drive: '0,0' is no place on part"),
        ((*BEAM, "--sensor", "999:+y"), "--sensor: no node 999 that moves"),
        ((*BEAM, "--support", "5:rz"), "has no 'rz' to hold; it has x, y, z"),
        ((*BEAM, "--nodes", "a.csv", "--nodes", "b.csv"), "--nodes: 2 for 1 masses"),
        ((*BEAM, "--part", "a/b"), "--part: 'a/b' is part of file names"),
        ((*BEAM, "--nodes", EXAMPLE / "beam.dof"), "no column 'node'"),
        (("--mass", f"{PLATE}/plate-stiffness.npz", "--stiffness", f"{PLATE}/plate-mass.npz",
          "--nodes", f"{PLATE}/plate-nodes.csv"), "exchanged, or the units others?"),
        (("--mass", f"{PLATE}/plate-mass.npz", "--stiffness", f"{PLATE}/plate-mass.npz",
          "--nodes", f"{PLATE}/plate-nodes.csv"), "is the same matrix as the mass: every natural frequency"),
    ],
)  # fmt: skip
def test_what_cannot_be_a_rig_is_refused_in_one_line_and_leaves_nothing(capsys, tmp_path, arguments, message):
    with pytest.raises(InputError) as refused:
        imported(capsys, *arguments, "--out", tmp_path / "rig.toml")
    assert message in str(refused.value)
    assert "\n" not in str(refused.value)
    assert not list(tmp_path.iterdir())


def test_nothing_is_replaced_unasked(capsys, tmp_path):
    (tmp_path / "rig-part-mass.npz").write_text("mine")
    with pytest.raises(InputError, match=r"rig-part-mass\.npz: exists already"):
        imported(capsys, *BEAM, "--out", tmp_path / "rig.toml")
    assert [path.name for path in tmp_path.iterdir()] == ["rig-part-mass.npz"]
    imported(capsys, *BEAM, "--out", tmp_path / "rig.toml", "--overwrite")
    with pytest.raises(InputError, match=r"a rig file ends in \.toml"):
        imported(capsys, *BEAM, "--out", tmp_path / "rig")
