"""A drive at its limit is noticed on the rig whose file names it, and the improved procedure spares it."""

import json

import pytest

from twin.cli import main
from twin.rigs import load_rig, save_rig

SWEEP = """
procedure = "stepped-sine"
frequencies = [24.0, 25.0]
amplitudes = [2.0]
settle = { tolerance = 0.005 }
measure = { seconds = 1.0 }
"""


@pytest.mark.parametrize(
    ("limits", "channel", "what"),
    [
        ({"voltage_limit": 0.5}, "amplifier", "the amplifier's limit of 0.5 V"),
        ({"amplifier": "current", "force_limit": 1.9}, "current", "the amplifier's limit of"),
        ({"stroke_limit": 4e-6}, "stroke", "the end stops, at 4e-06 m"),
    ],
)
def test_a_drive_at_its_limit_is_noticed_and_spared(tmp_path, capsys, limits, channel, what):
    rig = load_rig("steel-lap-joint")
    save_rig(rig.model_copy(update={"drive": rig.drive.model_copy(update=limits)}), tmp_path / "weak.toml")
    (tmp_path / "sweep.toml").write_text(SWEEP)
    arguments = [tmp_path / "sweep.toml", "--rig", tmp_path / "weak.toml", "--out", tmp_path / "out", "--json"]
    with pytest.raises(SystemExit):
        main(["rehearse", *map(str, arguments)])
    result = json.loads(capsys.readouterr().out)
    (warning,) = [one for one in result["warnings"] if one["kind"] == "limit-reached"]
    assert warning["reason"].startswith(f"{channel} is held at {what}")
    assert result["steps"][0]["limit_use"][channel] == pytest.approx(1.0, abs=0.02)
    if channel != "stroke":
        assert result["steps"][0]["distortion"]["force"] > 0.01
    improved = result["improved"]
    assert not [one for one in improved["warnings"] if one["kind"] == "limit-reached"]
    assert improved["steps"][0]["limit_use"][channel] < 0.9
    assert improved["steps"][0]["target_amplitude"] < 2.0


def test_a_rig_without_limits_has_no_more_channels_than_its_sensors(tmp_path, capsys):
    (tmp_path / "sweep.toml").write_text(SWEEP.replace("[2.0]", "[0.2]"))
    arguments = [tmp_path / "sweep.toml", "--rig", "steel-lap-joint", "--out", tmp_path / "out", "--json"]
    with pytest.raises(SystemExit):
        main(["rehearse", *map(str, arguments)])
    step = json.loads(capsys.readouterr().out)["steps"][0]
    assert set(step["range_use"]) == {"force", "acc1", "acc2"}
