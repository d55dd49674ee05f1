"""Rig files of format 2: the contract's example is read, and written back equal; mistakes are told with their place."""

import copy
import tomllib

import pytest
import tomli_w

from recordings.errors import InputError
from twin.rigs import RIG_FILES, load_rig, moduli_at, parse_rig, preload_names, save_rig
from twin.rigs.assumed import assumed
from twin.structure import assemble

CONTRACT = """
format = 2
name = "bracket-on-plate"

[[part]]                        # a straight plane beam
name = "lower"
kind = "beam"
start = [0.0, 0.0]              # m, neutral axis; x, y
end = [0.235, 0.0]
width = 0.0254                  # out of the plane
thickness = 0.00636
youngs_modulus = 198e9
density = 7880.0
shear_ratio = 0.0               # E / (kappa G); 0: Euler-Bernoulli
elements = 20

[[part]]
name = "upper"
kind = "beam"
start = [0.185, 0.00636]
end = [0.42, 0.00636]
width = 0.0254
thickness = 0.00636
youngs_modulus = 198e9
density = 7880.0

[[support]]                     # none at all: the structure hangs free
part = "lower"
at = 0.0
fix = ["x", "y", "rz"]          # or stiffness = { y = 1e6, rz = 50.0 }, N/m and Nm/rad, or both

[[joint]]                       # as many as there are
name = "lap"
kind = "thin-layer"
between = ["lower", "upper"]    # two beam parts
from = 0.185                    # m along the first part
to = 0.235
layer_height = 0.00636          # neutral axis to neutral axis
width = 0.0254
layer_elements = 3

[joint.preload."120N"]
normal_modulus = 3.9e8          # E', N/m2
shear_modulus = 7.6e7           # G'

[damping]
modal_ratio = [0.001, 0.002]    # the last one for all higher modes

[drive]                         # shaker fields as in format 1
part = "lower"
at = 0.05
direction = "+y"
armature_mass = 0.020
suspension_stiffness = 3150.0
force_factor = 5.5
coil_resistance = 1.5
coil_inductance = 0.0002
stinger_stiffness = 1.0e6

[[sensor]]                      # other fields as in format 1
channel = "acc1"
quantity = "acceleration"
part = "upper"
at = 0.115
direction = "+y"
range = 490.0

[[sensor]]
channel = "force"
quantity = "force"
part = "lower"
at = 0.05
range = 50.0
"""
"""The contract's example without what is given by matrices, and with what it says is as in format 1."""

MATRICES = {"name": "bracket", "kind": "matrices", "mass": "m.mtx", "stiffness": "k.mtx", "nodes": "n.csv"}
TIE = {"between": ["lower", "upper"], "at": [0.235, 0.05]}
SECOND = {"between": ["lower", "upper"], "kind": "thin-layer", "from": 0.19, "to": 0.2, "layer_height": 0.006}
MODULI = {"normal_modulus": 3.9e8, "shear_modulus": 7.6e7}


def example():
    table = tomllib.loads(CONTRACT)
    table["part"].append({**MATRICES, "modes_to_Hz": 3000.0})
    table["tie"] = [copy.deepcopy(TIE)]
    return table


def changed(place, value):
    """The example with one field given or, by None, left out; a table is put in its place or, by a number, added."""
    table = example()
    *folders, key = [int(p) if p.isdigit() else p for p in place.split(".")]
    inside = table
    for folder in folders:
        inside = inside[folder]
    if value is None:
        del inside[key]
    elif isinstance(key, int) and key == len(inside):
        inside.append(value)
    else:
        inside[key] = value
    return table


MISTAKES = [
    # unknown keys and numbers that are none
    ("wdith", 1.0, ["wdith", "no such field"]),
    ("part.0.thicknes", 0.01, ["part.0", "thicknes:", "no such field"]),
    ("support.0.stifness", {"y": 1.0}, ["support.0", "stifness", "no such field"]),
    ("joint.0.overlap", 0.05, ["joint.0", "overlap", "no such field"]),
    ("tie.0.stiffness", 1e6, ["tie.0", "stiffness", "no such field"]),
    ("drive.position", 0.05, ["drive.0", "position", "no such field"]),
    ("sensor.0.position", 0.05, ["sensor.0", "position", "no such field"]),
    ("part.0.width", -0.02, ["part.0", "width", "greater than", "-0.02"]),
    ("part.1.density", 0.0, ["part.1", "density", "greater than"]),
    ("part.1.elements", -3, ["part.1", "elements", "-3"]),
    ("part.1.youngs_modulus", float("inf"), ["part.1", "youngs_modulus", "finite"]),
    ("part.0.end", [0.0, 0.0], ["part.0", "same point"]),
    ("part.0.end", [float("nan"), 0.0], ["part.0", "end.0", "finite"]),
    ("part.0.end", [0.235, 0.0, 0.0], ["part.0", "end"]),
    ("part.0.kind", "plate", ["part.0", "plate", "beam", "matrices"]),
    ("part.2.modes_to_Hz", None, ["part.2", "modes_to_Hz", "required"]),
    ("support.0.at", -0.01, ["support.0.at", "greater than or equal to 0"]),
    ("support.0.stiffness", {"y": -1e6}, ["support.0.stiffness.y", "greater than"]),
    ("joint.0.layer_height", -0.006, ["joint.0.layer_height", "greater than"]),
    ("joint.0.from", -0.01, ["joint.0.from", "greater than or equal to 0"]),
    ("joint.0.preload.120N.shear_modulus", -1.0, ["joint.0.preload.120N.shear_modulus", "greater than"]),
    ("sensor.0.at", float("nan"), ["sensor.0.at", "finite"]),
    # parts that are not there
    ("support.0.part", "lowre", ["support.0", "'lowre'", "lower, upper, bracket"]),
    ("joint.0.between", ["lower", "uper"], ["joint 'lap'", "'uper'", "lower, upper, bracket"]),
    ("tie.0.between", ["lwoer", "upper"], ["tie.0", "'lwoer'", "lower, upper, bracket"]),
    ("drive.part", "Lower", ["drive", "'Lower'", "lower, upper, bracket"]),
    ("sensor.0.part", "upper ", ["sensor 'acc1'", "'upper '", "lower, upper, bracket"]),
    # places
    ("support.0.at", 0.3, ["support.0", "0.3", "beyond the end of 'lower'", "0.235"]),
    ("drive.at", 0.2351, ["drive", "0.2351", "beyond the end of 'lower'"]),
    ("sensor.0.at", 115.0, ["sensor 'acc1'", "115", "beyond the end of 'upper'"]),
    ("tie.0.at", [0.235, 0.5], ["tie.0", "0.5", "beyond the end of 'upper'"]),
    ("support.1", {"part": "bracket", "at": 3.5, "fix": ["z"]}, ["support.1", "3.5", "node number of 'bracket'"]),
    ("tie.1", {"between": ["bracket", "lower"], "at": [1.2, 0.0]}, ["tie.1", "1.2", "node number of 'bracket'"]),
    ("joint.0.to", 0.25, ["joint 'lap'", "0.25", "beyond the end of 'lower'"]),
    ("joint.0.from", 0.15, ["joint 'lap'", "0.15", "'upper'", "-0.035"]),
    ("part.1.end", [0.215, 0.00636], ["joint 'lap'", "0.235", "'upper'", "0.03 m long"]),
    ("joint.0.to", 0.1, ["joint.0", "0.1", "beyond from"]),
    ("part.1.end", [0.42, 0.01], ["joint 'lap'", "'lower'", "'upper'", "not parallel"]),
    # what holds nothing, or joins nothing
    ("joint.0.from", None, ["joint.0", "from .. to"]),
    ("joint.0.pairs", "pairs.csv", ["joint.0", "from .. to", "pairs"]),
    ("joint.1", {**SECOND, "name": "2", "from": None, "to": None, "preload": {"120N": MODULI}}, ["joint.1", "pairs"]),
    ("joint.0.between", ["lower", "bracket"], ["joint 'lap'", "pairs"]),
    ("joint.0.between", ["lower", "lower"], ["joint.0", "'lower' to itself"]),
    ("joint.0.between", ["lower"], ["joint.0.between"]),
    ("tie.0.between", ["upper", "upper"], ["tie.0", "'upper' to itself"]),
    ("tie.0.at", None, ["tie.0", "at or pairs"]),
    ("tie.1", {"between": ["lower", "bracket"], "pairs": "p.csv"}, ["tie.1", "pairs"]),
    ("support.0.fix", [], ["support.0", "holds nothing"]),
    ("support.0.fix", ["u"], ["support.0.fix.0"]),
    ("support.0.stiffness", {"rz": 50.0}, ["support.0", "rz cannot be fixed and on a spring"]),
    # directions
    ("drive.direction", "up", ["drive", "direction", "'up'", "+y"]),
    ("sensor.0.direction", [0.0, 2.0, 0.0], ["sensor.0.direction", "2.0", "unit vector"]),
    ("sensor.0.direction", [0.0, float("nan"), 0.0], ["sensor.0.direction", "unit vector"]),
    ("sensor.0.direction", [], ["sensor.0.direction", "unit vector"]),
    ("sensor.0.direction", "+z", ["sensor 'acc1'", "along z"]),
    ("drive.direction", [0.6, 0.0, 0.8], ["drive", "along z"]),
    # names and what belongs together
    ("part.1.name", "lower", ["part names", "unique", "lower"]),
    ("joint.1", {**SECOND, "name": "lap", "preload": {"120N": MODULI}}, ["joint names", "unique", "lap"]),
    ("sensor.0.channel", "force", ["sensor channels", "unique", "force"]),
    ("joint.1", {**SECOND, "name": "2", "preload": {"60N": MODULI}}, ["joint '2'", "preloads", "60N", "120N"]),
    ("joint.0.preload", {}, ["joint.0.preload"]),
    ("sensor.1.quantity", "acceleration", ["must measure force"]),
    ("sensor.1.at", 0.06, ["sensor 'force'", "where a shaker drives"]),
    ("sensor.1.part", "upper", ["sensor 'force'", "where a shaker drives"]),
    ("drive", None, ["drive", "required"]),
    ("drive", [], ["drive", "at least 1"]),
    ("part", [], ["part", "at least 1"]),
    ("format", 3, ["format", "3 is not known", "1 and 2"]),
]  # fmt: skip


def without_none(table):
    if isinstance(table, dict):
        return {key: without_none(value) for key, value in table.items() if value is not None}
    return [without_none(value) for value in table] if isinstance(table, list) else table


@pytest.mark.parametrize(("place", "value", "told"), MISTAKES, ids=[f"{p}={str(v)[:24]}" for p, v, _ in MISTAKES])
def test_a_mistake_is_told_in_one_line_with_its_place(place, value, told, tmp_path):
    file = tmp_path / "my-rig.toml"
    file.write_text(tomli_w.dumps(without_none(changed(place, value))))
    with pytest.raises(InputError) as refused:
        load_rig(file)
    message = str(refused.value)
    assert message.startswith(f"{file}: ")
    assert "\n" not in message
    assert "more problem" not in message, "one mistake is one problem"
    assert not [words for words in told if words not in message], message


def test_the_example_that_the_mistakes_are_made_in_is_right():
    assert len(parse_rig(tomli_w.dumps(example()).encode(), source="example").layout().parts) == 3


def test_the_contracts_example_is_read():
    rig = parse_rig(CONTRACT.encode(), source="contract.toml")
    assert (rig.joints[0].begin, rig.joints[0].to) == (0.185, 0.235)
    assert rig.place_of("acc1").direction == (0.0, 1.0, 0.0)
    assert len(assemble(rig).joints) == 1


@pytest.mark.parametrize("name", ["contract", "full", *RIG_FILES])
def test_what_is_read_is_written_back_equal(name, tmp_path):
    table = example()
    table["drive"] = [{**table["drive"], "name": "a"}, {**table["drive"], "name": "b", "direction": [0.6, 0.8, 0.0]}]
    table["support"].append({"part": "upper", "at": 0.235, "stiffness": {"y": 1e6, "rz": 50.0}})
    (tmp_path / "contract.toml").write_text(CONTRACT)
    (tmp_path / "full.toml").write_text(tomli_w.dumps(table))
    rig = load_rig(RIG_FILES.get(name, tmp_path / f"{name}.toml"))
    save_rig(rig, tmp_path / "again.toml")
    again = load_rig(tmp_path / "again.toml")
    if name == "stiffened-plate":
        assert again == rig.named_from(tmp_path)
        assert pytest.approx(assemble(rig).M, abs=0.0) == assemble(again).M
    else:
        assert again == rig
        assert again.layout() == rig.layout()
    save_rig(again, tmp_path / "thrice.toml")
    assert (tmp_path / "thrice.toml").read_bytes() == (tmp_path / "again.toml").read_bytes()


def test_one_drive_is_a_table_or_an_array_of_one():
    table = tomllib.loads(CONTRACT)
    array = {**table, "drive": [table["drive"]]}
    assert parse_rig(tomli_w.dumps(array).encode(), source="a") == parse_rig(CONTRACT.encode(), source="b")


def test_a_drive_without_a_shakers_fields_is_an_ideal_force():
    table = tomllib.loads(CONTRACT)
    assert not parse_rig(CONTRACT.encode(), source="a").shaker.ideal
    bare = {key: table["drive"][key] for key in ("part", "at", "direction")}
    rig = parse_rig(tomli_w.dumps({**table, "drive": bare}).encode(), source="b")
    assert rig.shaker.ideal
    assert "no shaker: an ideal force, one newton for each volt of the generator" in assumed(rig)


@pytest.mark.parametrize("support", [[], [{"part": "lower", "at": 0.0, "stiffness": {"y": 1e6}}]])
def test_neither_joints_nor_what_is_fixed_need_be_there(support):
    table = {**example(), "joint": [], "support": support}
    table["part"].pop()
    rig = parse_rig(tomli_w.dumps(table).encode(), source="bare.toml")
    assert preload_names(rig) == ()
    assert moduli_at(rig) == ()
    structure = assemble(rig)
    assert structure.joints == ()
    across = structure.rigid_translation((0.0, 1.0, 0.0))
    assert across @ structure.stiffness(0.0, 0.0) @ across == pytest.approx(1e6 * len(support), rel=1e-6, abs=1.0)
