"""A prediction takes the drive and the channel that are asked for; what goes there comes back (Maxwell and Betti)."""

import numpy as np
import pytest
import tomli_w
from drawn_frames import CLAMP, THICK, beam, drawn

import twin

AT = {"root": 0.1, "tip": 0.38}
FREQUENCIES = np.linspace(20.0, 60.0, 9)


@pytest.fixture(scope="module")
def rig(tmp_path_factory):
    clamp = {"part": "bar", "at": 0.0, "fix": CLAMP}
    table = drawn([beam("bar", (0.0, 0.0), (0.4, 0.0), THICK)], [clamp])
    places = {name: {"part": "bar", "at": at} for name, at in AT.items()}
    table["drive"] = [{"name": name, "direction": "+y", **place} for name, place in places.items()]
    table["sensor"] = [
        sensor for name, place in places.items() for sensor in (
            {"channel": f"force-{name}", "quantity": "force", "range": 50.0, **place},
            {"channel": f"at-{name}", "quantity": "acceleration", "range": 500.0, "direction": "+y", **place},
        )
    ]  # fmt: skip
    path = tmp_path_factory.mktemp("rigs") / "two-drives.toml"
    path.write_text(tomli_w.dumps(table))
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
