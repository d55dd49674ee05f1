"""Nonsense about shaker, sensors and converter is refused with the field's name."""

import tomllib

import pytest
import tomli_w

from recordings.errors import InputError
from twin.rigs import RIG_FILES, load_rig, parse_rig, save_rig


def changed(place, **fields):
    table = tomllib.loads(RIG_FILES["steel-lap-joint"].read_text())
    part = table["sensor"][int(place[-1])] if place[:-1] == "sensor" else table.setdefault(place, {})
    part.update(fields)
    return tomli_w.dumps(table).encode()


@pytest.mark.parametrize(
    ("place", "fields", "complaint"),
    [
        ("drive", {"amplifier": "charge"}, "drive.amplifier"),
        ("drive", {"voltage_limit": 0.0}, "drive.voltage_limit"),
        ("drive", {"current_limit": float("inf")}, "drive.current_limit"),
        ("drive", {"force_limit": -1.0}, "drive.force_limit"),
        ("drive", {"stroke_limit": "wide"}, "drive.stroke_limit"),
        ("drive", {"stroke_limit": 0.005, "stop_stiffness": 1e9}, "bounce faster"),
        ("drive", {"half_force_stroke": float("nan")}, "drive.half_force_stroke"),
        ("drive", {"stinger_lateral_stiffness": -1.0}, "drive.stinger_lateral_stiffness"),
        ("drive", {"output_resistance": 50.0}, "holds the current"),
        ("drive", {"amplifier": "current", "output_resistance": 0.5}, "below coil_resistance"),
        ("sensor1", {"stinger_side_mass": 0.01}, "belongs to the force cell"),
        ("sensor0", {"transverse_sensitivity": 0.03}, "belongs to an accelerometer"),
        ("sensor1", {"transverse_sensitivity": 3.0}, "transverse_sensitivity"),
        ("sensor1", {"mounting_damping": 0.03}, "needs a mounting_frequency"),
        ("acquisition", {"clock_error_ppm": 1e6}, "acquisition.clock_error_ppm"),
        ("acquisition", {"anti_alias": "steep"}, "acquisition.anti_alias"),
        ("drift", {"preload_loss_per_day": 1.0}, "drift.preload_loss_per_day"),
    ],
)
def test_nonsense_is_refused_with_its_place(place, fields, complaint):
    with pytest.raises(InputError, match=complaint) as refused:
        parse_rig(changed(place, **fields), source="my-rig.toml")
    assert str(refused.value).startswith("my-rig.toml: ")
    assert "\n" not in str(refused.value)


def test_a_full_data_sheet_is_read_and_written_back_equal(tmp_path):
    rig = parse_rig(
        changed(
            "drive", amplifier="current", amplifier_gain=2.0, output_resistance=500.0, voltage_limit=30.0,
            current_limit=5.0, force_limit=20.0, stroke_limit=0.005, stop_stiffness=2e6, half_force_stroke=0.01,
            stinger_lateral_stiffness=300.0,
        ),
        source="my-rig.toml",
    )  # fmt: skip
    save_rig(rig, tmp_path / "rig.toml")
    assert load_rig(tmp_path / "rig.toml") == rig
    assert rig.drive.amplifier == "current"
