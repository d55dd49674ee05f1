"""What a rig file leaves out is told in one place; an ideal force where it has no shaker."""

import re

import pytest

from recordings import InputError
from twin.bench import drive_limits, open_bench
from twin.rigs import RIG_FILES, load_rig, parse_rig
from twin.rigs.assumed import assumed

SHAKER = (
    "armature_mass",
    "suspension_stiffness",
    "force_factor",
    "coil_resistance",
    "coil_inductance",
    "stinger_stiffness",
)
STEEL = RIG_FILES["steel-lap-joint"].read_text()


def without(*names, text=STEEL):
    for name in names:
        text = re.sub(rf"(?m)^{name} = .*\n", "", text)
    return parse_rig(text.encode(), source="my.toml")


def test_a_law_that_is_borrowed_and_none_are_told_apart():
    assert (
        assumed(load_rig("steel-lap-joint"))[0] == "joint: the law calibrated on steel-lap-joint, scaled to its own E'"
    )
    assert assumed(without("law"))[0] == "joint: no law, so linear"
    assert not [line for line in assumed(without("law"), law=False) if "law" in line]


@pytest.mark.parametrize(
    ("field", "value", "told"),
    [
        ("shear_ratio", "3.0", "lower, upper: no shear, bent as Euler and Bernoulli have it"),
        ("half_force_stroke", "0.01", "shaker: the same force per ampere at any stroke"),
        ("noise_density", "1e-4", "force, acc1, acc2: no noise"),
        ("high_pass", "0.1", "force, acc1, acc2: no high-pass"),
    ],
)
def test_a_field_is_told_where_it_is_left_out_and_only_there(field, value, told):
    bare = without("noise_density", "high_pass")
    assert told in assumed(bare)
    text = STEEL
    for head in ("[lower]", "[upper]", "[drive]", "[[sensor]]"):
        belongs = {"shear_ratio": ("[lower]", "[upper]"), "half_force_stroke": ("[drive]",)}.get(field, ("[[sensor]]",))
        if head in belongs:
            text = re.sub(rf"(?m)^{field} = .*\n", "", text)
            text = re.sub(rf"(?m)^{re.escape(head)}.*$", lambda m: f"{m.group()}\n{field} = {value}", text)
    assert told not in assumed(parse_rig(text.encode(), source="my.toml"))


def test_a_rig_without_a_shaker_is_driven_by_an_ideal_force():
    rig = without(*SHAKER)
    assert rig.shaker.ideal
    assert drive_limits(rig) == {}
    assert open_bench(rig).built.shaker is None
    assert "no shaker: an ideal force, one newton for each volt of the generator" in assumed(rig)


@pytest.mark.parametrize("left_out", [SHAKER[:1], SHAKER[2:]])
def test_half_a_shaker_is_refused_with_what_it_lacks(left_out):
    with pytest.raises(InputError, match=f"drive: a shaker needs {', '.join(left_out)} too; without any"):
        without(*left_out)


def test_limits_without_a_shaker_are_refused():
    with pytest.raises(InputError, match="a shaker needs"):
        without(
            *SHAKER,
            text=STEEL.replace("position = 0.05               # stated\n", "position = 0.05\nforce_limit = 20.0\n"),
        )
