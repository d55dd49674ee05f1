"""A hammer test on the free-hung rig, rehearsed: its modes are the rig's, and what is wrong with a test is named."""

from __future__ import annotations

import json

import numpy as np
import pytest

from recordings import FrequencyTable, read_table
from twin.cli import main
from twin.rigs import RIG_FILES, load_rig, moduli_values
from twin.structure import assemble, normal_modes

POINTS = [("lower", at) for at in (0.0, 0.04, 0.08, 0.12, 0.16)] + [
    ("upper", at) for at in (0.05, 0.09, 0.13, 0.17, 0.2, 0.235)
]
HIT = 'procedure = "impact"\nhits = {hits}\nrecord = {record}\ntrigger = 0.5\n{more}\n'
HAMMER = "[hammer]\npeak = 4.0\nwidth = 3e-4\n"


def run(capsys, *arguments):
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


def rehearsed(folder, name, *, rig="hung-lap-joint", points=POINTS, hits=2, record=3.0, more="", hammer=""):
    """The recording of an impact test, made by the command."""
    file = folder / f"{name}.toml"
    listed = "".join(f'[[point]]\nname = "{n}"\npart = "{part}"\nat = {at}\n' for n, (part, at) in enumerate(points, 1))
    file.write_text(HIT.format(hits=hits, record=record, more=more) + listed + HAMMER + hammer)
    with pytest.raises(SystemExit) as ended:
        main(["rehearse", str(file), "--rig", str(rig), "--out", str(folder / name), "--rounds", "0", "--quiet"])
    assert ended.value.code == 0
    return folder / name / "run.mcap"


@pytest.fixture(scope="module")
def hammered(tmp_path_factory):
    return rehearsed(tmp_path_factory.mktemp("hammer"), "roving", hits=3, hammer="double_hits = [8]\n")


@pytest.fixture(scope="module")
def natural_Hz():
    """Of the rig with its accelerometers and without a shaker."""
    rig = load_rig("hung-lap-joint")
    s = assemble(rig.hit_at(rig.drive_place))
    Hz = normal_modes(s.M, s.stiffness(*moduli_values(rig)), 12).frequency_Hz
    return Hz[Hz > 10.0]


def test_its_modes_are_the_rigs_within_a_tenth_of_a_per_cent_and_alike(hammered, natural_Hz, tmp_path, capsys, caplog):
    files = [tmp_path / name for name in ("modes.csv", "chart.png", "report.html", "view.rrd")]
    options = [word for pair in zip(("--out", "--picture", "--report", "--save"), files, strict=True) for word in pair]
    status, printed, said = run(capsys, "modes", hammered, "--rig", "hung-lap-joint", *options, "--json")
    assert status == 0, said
    result = json.loads(printed)
    found_Hz = [mode["frequency_Hz"]["value"] for mode in result["modes"]]
    assert found_Hz == pytest.approx(natural_Hz[: len(found_Hz)], rel=1e-3)
    assert len(found_Hz) == 5, "all up to 2 kHz"
    ratios = load_rig("hung-lap-joint").damping.modal_ratio
    expected = [*ratios, *[ratios[-1]] * (len(found_Hz) - len(ratios))]
    assert [mode["damping_ratio"]["value"] for mode in result["modes"]] == pytest.approx(expected, rel=0.03)
    assert [(pair["mode"], pair["model_mode"]) for pair in result["pairs"]] == [(n, n) for n in range(1, 6)]
    assert min(pair["mac"] for pair in result["pairs"]) > 0.99
    assert max(mode["phase_scatter_deg"] for mode in result["modes"]) < 3.0
    table = read_table(files[0])
    assert isinstance(table, FrequencyTable)
    assert table.mode.tolist() == [1, 2, 3, 4], "one slides along the joint, and is no bending mode"
    assert table.frequency_Hz == pytest.approx(np.delete(natural_Hz[:5], 3), rel=1e-3)
    assert files[1].read_bytes().startswith(b"\x89PNG")
    assert files[3].stat().st_size > 10_000
    page = files[2].read_text()
    assert all(word in page for word in ("Stabilisation", "Nyquist", "MAC", "coherence", "double hit"))
    assert page.count("data:image/png") == 5
    assert caplog.messages == [], "a library's remarks on its own pictures are none of the user's"


@pytest.mark.parametrize(("options", "numbers"), [(("--rig", "hung-lap-joint"), [2, 3]), ((), [1, 2])])
def test_a_table_has_the_numbers_of_the_models_modes(hammered, options, numbers, natural_Hz, tmp_path, capsys):
    out = tmp_path / "modes.csv"
    status, _, said = run(capsys, "modes", hammered, "--band", 400, 1200, *options, "--out", out)
    assert status == 0, said
    found = read_table(out)
    assert found.mode.tolist() == numbers
    assert found.frequency_Hz == pytest.approx(natural_Hz[1:3], rel=1e-3)


def test_a_double_hit_is_named_and_left_out(hammered, capsys):
    status, _, said = run(capsys, "modes", hammered, "--band", 100, 600)
    assert status == 0
    assert "point 3, hit 2 is set aside: double hit" in said
    assert said.count("set aside") == 1


def test_a_wrong_window_is_named(tmp_path, capsys):
    short = rehearsed(tmp_path, "short", points=POINTS[::5], record=0.5)
    for options, reason in (
        (("--exponential", 1), "without an exponential window"),
        (("--force-window", 1e-4), "cuts the pulse"),
        (("--exponential", 1e-7), "times the damping that the mode"),
    ):
        status, _, said = run(capsys, "modes", short, "--band", 100, 600, *options)
        assert status == 0
        assert "wrong window" in said
        assert reason in said
    assert "wrong window" not in run(capsys, "modes", short, "--band", 400, 600)[2]


def test_a_sensor_on_a_node_is_named(tmp_path, capsys):
    head, _, _, last = RIG_FILES["hung-lap-joint"].read_text().split("[[sensor]]")
    force = RIG_FILES["hung-lap-joint"].read_text().split("[[sensor]]")[1]
    rig = tmp_path / "on-a-node.toml"
    rig.write_text("[[sensor]]".join([head, force, last.replace("at = 0.235", "at = 0.1795")]))
    test = rehearsed(tmp_path, "node", rig=rig, points=POINTS[::2])
    status, _, said = run(capsys, "modes", test, "--rig", rig)
    assert status == 0
    told = [line for line in said.replace("\n", " ").split("note: ") if "at a node" in line]
    assert len(told) == 1
    assert "acc2 is at a node of mode 2" in told[0]
    assert "node" not in run(capsys, "modes", test, "--rig", rig, "--band", 100, 400)[2]


def test_a_roving_accelerometer_finds_the_same_if_it_is_light_and_is_told_if_not(natural_Hz, tmp_path, capsys):
    light = tmp_path / "light-sensors.toml"
    light.write_text(RIG_FILES["hung-lap-joint"].read_text().replace("mass = 0.002", "mass = 1e-5"))
    more = 'roving = "accelerometer"\nsensor = "acc1"'
    test = rehearsed(tmp_path, "light", rig=light, points=POINTS[::2], more=more)
    result = json.loads(run(capsys, "modes", test, "--rig", light, "--band", 100, 1100, "--json")[1])
    assert [pair["model_mode"] for pair in result["pairs"]] == [1, 2, 3]
    assert min(pair["mac"] for pair in result["pairs"]) > 0.99
    assert not any("roves" in note for note in result["notes"])
    heavy = rehearsed(tmp_path, "heavy", points=POINTS[::5], more=more)
    assert (
        "acc1, 2 g, moves natural frequencies by up to 0." in run(capsys, "modes", heavy, "--rig", "hung-lap-joint")[2]
    )


def test_what_an_impact_test_is_not_for_is_refused_in_one_line(hammered, tmp_path, capsys):
    for arguments in (
        ("identify", hammered, "--rig", "hung-lap-joint", "--out", tmp_path / "model.toml"),
        ("convert", hammered, tmp_path / "hits.uff", "--frf"),
    ):
        status, _, said = run(capsys, *arguments, "--quiet")
        assert status == 2
        assert "is an impact test; take it to 'twin modes'" in said.replace("\n", " ")
    assert not list(tmp_path.iterdir())
    status, _, said = run(capsys, "modes", hammered, "--rig", "l-frame", "--quiet")
    assert (status, len(said.strip().splitlines())) == (2, 1)


def test_points_that_the_rig_has_not_are_refused(tmp_path, capsys):
    file = tmp_path / "beyond.toml"
    file.write_text(HIT.format(hits=1, record=1.0, more="") + '[[point]]\nname = "1"\npart = "upper"\nat = 3.0\n')
    status, _, said = run(capsys, "rehearse", file, "--rig", "hung-lap-joint", "--out", tmp_path / "out", "--quiet")
    assert status == 2
    assert "lies beyond the end of 'upper'" in said
    assert not (tmp_path / "out").exists()


def test_pairs_are_made_of_what_is_alike_and_near():
    from twin.identify.modes.pairing import paired

    alike = np.array([[0.1, 0.98], [0.97, 0.2], [0.3, 0.3]])
    assert paired(np.array([100.0, 103.0, 900.0]), np.array([101.0, 102.0]), alike) == {0: 1, 1: 0}
