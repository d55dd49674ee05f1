"""A recording names its preload by a number; the rig file names its own like ``120N``."""

from __future__ import annotations

import pytest

from twin.rigs import foreign_preload, load_rig, nearest_preload, preload_record, recorded_preload

STEEL, HYBRID = load_rig("steel-lap-joint"), load_rig("hybrid-joint")


@pytest.mark.parametrize(
    ("rig", "info", "expected"),
    [
        (STEEL, {"preload_N": "540"}, "540N"),
        (STEEL, {"preload_N": "119.4"}, "120N"),
        (STEEL, {}, "120N"),
        # A torque says nothing about a rig that counts newtons.
        (STEEL, {"preload_Nm": "540"}, "120N"),
        (HYBRID, {"preload_Nm": "13.6"}, "14Nm"),
    ],
)
def test_the_nearest_preload_is_taken(rig, info, expected):
    assert nearest_preload(rig, info)[0] == expected


def test_names_and_records_are_inverse():
    for name in (*STEEL.joint.preload, *HYBRID.joint.preload):
        value, unit = recorded_preload(preload_record(name))
        assert f"{value:g}{unit}" == name
    assert preload_record("tight") == {}
    assert recorded_preload({}) is None


def test_a_preload_that_the_rig_lacks_is_said():
    assert foreign_preload(STEEL, {"preload_N": "122"}) is None
    assert "150% off 120N" in foreign_preload(STEEL, {"preload_N": "300"}).replace("+", "")
