"""A prediction takes the drive and the channel that are asked for; what goes there comes back (Maxwell and Betti)."""

import numpy as np
import pytest

import twin

RIG = """
format = 2
name = "two-drives"

[[part]]
name = "bar"
kind = "beam"
start = [0.0, 0.0]
end = [0.4, 0.0]
width = 0.03
thickness = 0.008
youngs_modulus = 70e9
density = 2700.0
elements = 20

[[support]]
part = "bar"
at = 0.0
fix = ["x", "y", "rz"]

[damping]
modal_ratio = [0.01]
"""
AT = {"root": 0.1, "tip": 0.38}
BOTH = "".join(
    f"""
[[drive]]
name = "{name}"
part = "bar"
at = {at}
direction = "+y"

[[sensor]]
channel = "force-{name}"
quantity = "force"
part = "bar"
at = {at}
range = 50.0

[[sensor]]
channel = "at-{name}"
quantity = "acceleration"
part = "bar"
at = {at}
direction = "+y"
range = 500.0
"""
    for name, at in AT.items()
)
FREQUENCIES = np.linspace(20.0, 60.0, 9)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    path = tmp_path_factory.mktemp("rigs") / "two-drives.toml"
    path.write_text(RIG + BOTH)
    return twin.load_rig(path)


def accelerations(rig, **asked):
    return rig.predict(FREQUENCIES, force_N=1.0, **asked).response.acceleration_m_per_s2


def test_there_and_back_are_the_same(rig):
    there = accelerations(rig, shaker="root", channel="at-tip")
    back = accelerations(rig, shaker="tip", channel="at-root")
    np.testing.assert_allclose(there, back, rtol=1e-6)
    assert not np.allclose(there, accelerations(rig, shaker="tip", channel="at-tip"), rtol=0.1)


def test_the_first_drive_acts_where_none_is_asked_for(rig):
    np.testing.assert_array_equal(
        accelerations(rig, channel="at-tip"), accelerations(rig, shaker="root", channel="at-tip")
    )


@pytest.mark.parametrize(
    ("asked", "told"), [({"shaker": "top"}, "root, tip"), ({"channel": "acc9"}, "at-root, at-tip")]
)
def test_what_the_rig_has_not_is_told_with_what_it_has(rig, asked, told):
    with pytest.raises(twin.InputError, match=told):
        accelerations(rig, **asked)
