"""`twin rig show`: what it draws, what it tells, and what it calls implausible."""

import json

import pytest

from recordings.errors import InputError
from twin.cli import group
from twin.rigs import RIG_FILES, Effect, load_rig, save_rig
from twin.structure.modelled_rig import modelled_rig
from twin.structure.plausibility import implausible
from twin.views.rig_figure import rig_figure


def shown(capsys, *arguments):
    group.main(args=["rig", "show", *arguments, "--json"], prog_name="twin", standalone_mode=False)
    return json.loads(capsys.readouterr().out)


@pytest.mark.parametrize("name", sorted(RIG_FILES))
def test_every_shipped_rig_is_told(capsys, name):
    table, rig = shown(capsys, name), load_rig(name)
    assert set(table) == {
        "natural_frequencies_Hz",
        "rigid_modes",
        "parts",
        "joints",
        "laws",
        "reductions",
        "sensors",
        "effects",
        "assumed",
        "warnings",
    }
    frequencies = table["natural_frequencies_Hz"]
    assert len(frequencies) == 10
    assert frequencies == sorted(frequencies)
    assert frequencies[0] > 5.0
    assert table["rigid_modes"] == {"hung-lap-joint": 3, "stiffened-plate": 6}.get(name, 0)
    assert table["sensors"] == [sensor.channel for sensor in rig.sensor]
    errors = [one["frequency_error"] for one in table["reductions"].values()]
    assert len(errors) == {"stiffened-plate": 2}.get(name, 0)
    assert max(errors, default=0.0) < 1e-4
    assert table["joints"] == [joint.name for joint in rig.joints]


def test_effects_are_told_and_said_to_be_no_part_of_the_modes(capsys, tmp_path):
    rig = load_rig("l-frame")
    own = Effect(cause="channel-gain", parameters={"channel": rig.response_sensors[0].channel, "factor": 1.1})
    path = tmp_path / "with-effect.toml"
    save_rig(rig.model_copy(update={"effect": [own]}), path)
    assert shown(capsys, str(path))["effects"] == ["channel-gain"]
    group.main(args=["rig", "show", str(path)], prog_name="twin", standalone_mode=False)
    assert "effects: channel-gain; they act on the bench" in capsys.readouterr().err


def test_pictures_are_written_whole(capsys, tmp_path):
    picture, view = tmp_path / "rig.png", tmp_path / "rig.rrd"
    shown(capsys, "l-frame", "--picture", str(picture), "--save", str(view))
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert view.read_bytes().startswith(b"RRF")
    assert sorted(tmp_path.iterdir()) == [picture, view]


def test_a_long_sentence_is_not_cut_off():
    rig = load_rig("l-frame")
    figure = rig_figure(modelled_rig(rig.model_copy(update={"name": "a frame of four bolted beams, on its foot"})))
    figure.canvas.draw()
    assert "on its foot" in figure.axes[0].get_title()
    said = figure.axes[0].title.get_window_extent()
    assert said.x0 >= 0
    assert said.x1 <= figure.bbox.x1


@pytest.mark.parametrize("arguments", [
    ("nowhere.toml",), ("l-frame", "--preload", "3N"), ("l-frame", "--picture", "nowhere/rig.png"),
        ("l-frame", "--picture", "rig.xyz"), ("composite-beam",),
])  # fmt: skip
def test_what_cannot_be_shown_is_told_in_one_line(arguments):
    with pytest.raises(InputError) as refused:
        group.main(args=["rig", "show", *arguments], prog_name="twin", standalone_mode=False)
    assert "\n" not in str(refused.value)


def warnings(tmp_path, **changes):
    """What is told of a two-joint rig whose file is changed by text."""
    path = tmp_path / "rig.toml"
    save_rig(load_rig("two-lap-joints"), path)
    text = path.read_text()
    for was, now in changes.values():
        assert was in text
        text = text.replace(was, now, 1)
    path.write_text(text)
    return implausible(modelled_rig(load_rig(path)))


def test_nothing_is_implausible_of_a_plausible_rig(tmp_path):
    assert warnings(tmp_path) == ()


def test_millimetres_in_all_lengths_and_gigapascals_are_told(capsys, tmp_path):
    rig, path = load_rig("steel-lap-joint"), tmp_path / "rig.toml"
    beam = {"length": 235.0, "width": 25.4, "thickness": 6.36, "youngs_modulus": 198.0}
    beams = {name: getattr(rig, name).model_copy(update=beam) for name in ("lower", "upper")}
    joint = rig.joint.model_copy(update={"overlap": 50.0, "layer_height": 6.36})
    save_rig(rig.model_copy(update=beams | {"joint": joint}), path)
    told = shown(capsys, str(path))["warnings"]
    for part in ("lower", "upper"):
        assert f"part '{part}': 235 m long; metres are asked for, no millimetres" in told
        assert f"part '{part}': youngs_modulus 198 N/m2 is no solid's; SI units are asked for" in told


@pytest.mark.parametrize(
    ("was", "now", "told"),
    [
        ("youngs_modulus = 198000000000.0", "youngs_modulus = 198000.0", "no solid's"),
        ("density = 7880.0", "density = 7.88", "no solid's"),
        ("density = 7880.0", "density = 20.0", "sound would run at"),
        ("thickness = 0.00636", "thickness = 0.03", "times as long as thick"),
        ("0.0023", "0.23", "not per cent"),
        ("mass = 0.002", "mass = 0.2", "of the structure"),
        ('part = "middle"\nat = 0.1', 'part = "root"\nat = 0.0', "nothing moves there"),
        ("shear_modulus = 76000000.0", "shear_modulus = 7.6e12", "times E'"),
        ("layer_height = 0.00636", "layer_height = 0.000636", "lie 0.00636 m apart; it is measured from neutral axis"),
        ("elements = 18", "elements = 4", "coarse"),
        ('fix = [\n    "x",\n    "y",\n    "rz",\n]', 'fix = ["x"]', "nothing holds"),
    ],
)
def test_a_slip_of_the_pen_is_told(tmp_path, was, now, told):
    assert any(told in line for line in warnings(tmp_path, change=(was, now)))
