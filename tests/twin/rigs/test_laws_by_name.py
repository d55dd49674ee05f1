"""Laws by name in rig files of both formats: read, written, told, refused."""

from __future__ import annotations

import numpy as np
import pytest

from recordings import InputError
from twin.bench import BenchSetup, open_bench
from twin.joint import load_laws
from twin.rigs import LawTable, LayerLawTable, NamedLaws, load_rig, nominal_rig_file, parse_rig
from twin.structure.law_table import layer_table


def linear(rig):
    return rig.with_joints([joint.model_copy(update={"law": None}) for joint in rig.joints])


RIG = load_rig("steel-lap-joint")
LINEAR = linear(RIG)
STEEL = nominal_rig_file(LINEAR).decode()
PLATE = nominal_rig_file(linear(load_rig("stiffened-plate"))).decode()
IWAN = '\n[joint.law.slip]\nname = "iwan"\nstiffness = 3e7\nslips_at = 1e-6\n'
BOTH = """
[[joint.law.opening]]
name = "saturating"
softening = 2e8
begins_at = 2e-6

[[joint.law.opening]]
name = "stop"
gap = 1e-6
stiffness = 1e8

[joint.law.slip]
name = "running-loss"
loss = 1e9
reached_at = 1e-6
"""


def read(text):
    return parse_rig(text.encode(), source="rig.toml")


def test_laws_by_name_are_read_and_written_back():
    rig = read(STEEL + BOTH)
    law = rig.joints[0].law
    assert isinstance(law, NamedLaws)
    assert [one.name for one in law.opening] == ["saturating", "stop"]
    assert law.slip[0].values == {"loss": 1e9, "reached_at": 1e-6}
    assert read(nominal_rig_file(rig).decode()) == rig
    assert "over its opening it softens by 2e+08 N/m2" in law.sentence
    assert "over its slip it loses" in law.sentence


def test_format_2_names_them_likewise():
    assert PLATE.count("[[joint]]") == 1
    before, after = PLATE.split("[[joint]]")
    name, rest = after.split("\n\n", 1) if "\n\n" in after else (after, "")
    rig = read(f"{before}[[joint]]{name}\n{rest}".replace("[joint.preload", IWAN.strip() + "\n\n[joint.preload", 1))
    assert rig.joint[0].law.slip[0].name == "iwan"


def test_a_joint_without_a_law_is_linear_and_one_that_borrows_it_softens_as_its_lender():
    open_ = np.array([3e-6])
    lender, without = (open_bench(rig, setup=BenchSetup(drive="force")).built.laws[0] for rig in (RIG, LINEAR))
    borrowing = read(STEEL + '\n[joint.law]\nof = "steel-lap-joint"\n')
    law = open_bench(borrowing, setup=BenchSetup(drive="force")).built.laws[0]
    assert without.normal.describing_function(open_) == 0
    assert without.loss is None
    assert law.normal.describing_function(open_) == lender.normal.describing_function(open_)
    assert law.normal.describing_function(open_).real < -1e8
    with pytest.raises(InputError, match=r"joint\.law\.of"):
        read(STEEL + '\n[joint.law]\nof = "hybrid-joint"\n')


def test_tables_are_read_as_before():
    over_points = "\n[joint.law]\nopening_m=[0.0,1e-6]\nsoftening=[0.0,1e8]\nslip_m=[0.0,1e-6]\nloss=[0.0,1e8]\n"
    over_sensor = '\n[joint.law]\nchannel="acc2"\namplitude_m=[0.0,1e-3]\nsoftening=[0.0,1e8]\nloss=[0.0,1e8]\n'
    assert isinstance(read(STEEL + over_points).joints[0].law, LayerLawTable)
    assert isinstance(read(STEEL + over_sensor).joints[0].law, LawTable)
    assert "softens by up to 1e+08" in read(STEEL + over_points).joints[0].law.sentence


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (IWAN.replace("iwan", "iwen"), r"joint\.law\.slip\.0: no law 'iwen': perhaps iwan"),
        (IWAN.replace("3e7", "-3e7"), r"joint\.law\.slip\.0\.stiffness: .*greater than 0 \(got"),
        (IWAN.replace("slips_at", "slip_at"), r"slip\.0\.slip_at: no such field, perhaps 'slips_at' is meant"),
        (IWAN.replace("3e7", "9e7"), r"takes 9e\+07 N/m2 off G', which is 7\.\d+e\+07 N/m2 at preload"),
        ('\n[joint.law]\nname = "iwan"\n', r"joint\.law: what does the law act on\?"),
        ("\n[joint.law]\nslip = []\n", r"joint\.law: it has no law"),
        ("\n[joint.law]\nopening_m = [0.0, 1e-6]\n", r"joint\.law\.softening: Field required"),
        ('\n[joint.law]\nchannel = "acc1"\n', r"joint\.law\.amplitude_m: Field required"),
        ('\n[joint.law.slip]\nfile = "my_law.py"\n', r"joint\.law\.slip\.0\.name: Field required"),
    ],
)
def test_mistakes_are_told_by_field(law, said):
    with pytest.raises(InputError, match=said):
        read(STEEL + law)


def test_reading_a_rig_runs_no_law(tmp_path, monkeypatch):
    """A stranger's rig may lie beside a stranger's law; only its user's word runs that."""
    monkeypatch.setattr("twin.joint.registry._loaded", {})
    (tmp_path / "iwen.py").write_text("from pathlib import Path\nPath(__file__).with_name('run').touch()\n")
    rig = tmp_path / "rig.toml"
    rig.write_text(STEEL + IWAN.replace("iwan", "iwen"))
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError, match="no law 'iwen'"):
        load_rig(rig)
    assert not (tmp_path / "run").exists()
    with pytest.raises(InputError, match="has no law"):
        load_laws(tmp_path / "iwen.py")
    assert (tmp_path / "run").exists()


def test_the_bench_has_the_moduli_of_the_file_at_rest_and_the_law_beyond():
    linear, named = (open_bench(read(STEEL + law), setup=BenchSetup(drive="force")).built for law in (zero_law(), IWAN))
    frequency_Hz = np.array([26.4, 157.0, 471.0])
    at_rest = [built.rig(0.0, 11264.0).transfer(frequency_Hz)[:, -1, 0] for built in (linear, named)]
    np.testing.assert_allclose(at_rest[0], at_rest[1], rtol=1e-6)
    laws = named.laws[0].slip
    assert sum(law.describing_function(np.array(1e-9)).real for law in laws) == pytest.approx(0.0, abs=1e-3 * 3e7)


def zero_law():
    return "\n[joint.law]\nopening_m=[0.0,1e-6]\nsoftening=[0.0,0.0]\nslip_m=[0.0,1e-6]\nloss=[0.0,0.0]\n"


def test_predictions_take_what_a_table_can_say_and_refuse_the_rest():
    rig = read(STEEL + BOTH)
    table = layer_table(rig, E=3.9e8, G=7.6e7)
    o, s = np.array(table.opening_m), np.array(table.slip_m)
    opening = sum(law.force.describing_function(o) for law in rig.joints[0].law.opening)
    np.testing.assert_allclose(table.softening, -opening.real)
    np.testing.assert_allclose(np.interp(1e-6, s, table.loss), 5e8, rtol=0.02)
    with pytest.raises(ValueError, match="changes the stiffness as the layer slips"):
        layer_table(read(STEEL + IWAN), E=3.9e8, G=7.6e7)
