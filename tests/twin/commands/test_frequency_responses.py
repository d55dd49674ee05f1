"""Frequency responses on the command line: identify, diagnose and export; what is wrong is one line."""

import json

import numpy as np
import pytest
from clamped_beam import LAB

from recordings.errors import InputError
from twin.cli import group
from twin.rigs import load_rig, save_rig


def twin(capsys, *arguments):
    status = group.main(args=[*map(str, arguments), "--json"], prog_name="twin", standalone_mode=False)
    return status, json.loads(capsys.readouterr().out)


@pytest.fixture(scope="module")
def files(tmp_path_factory):
    """Three intact cases and one without the fifth mass, as archives, and the rig file."""
    folder, rng = tmp_path_factory.mktemp("frf"), np.random.default_rng(31)
    save_rig(LAB.rig, folder / "beam.toml")
    truth = LAB.with_modulus(LAB.rig, 0.98, elements=42)
    for name, rig in (*((f"intact-{n}", truth) for n in range(3)), ("changed", LAB.without(truth, "m5"))):
        (one,) = LAB.responses(rig, rng, scatter=0.003).responses
        np.savez(
            folder / f"{name}.npz", frequency_Hz=one.frequency_Hz, frf=one.H, channels=["tip"], frf_form="accelerance"
        )
    return folder


@pytest.mark.slow
def test_from_intact_cases_to_a_named_change(files, capsys):
    intact = sorted(files.glob("intact-*.npz"))
    model = files / "model.toml"
    _, found = twin(capsys, "identify", *intact, "--rig", files / "beam.toml", "--out", model)
    assert found["frequency_scatter"] == pytest.approx(0.003, rel=0.6)
    assert found["linear"]["youngs_modulus beam"]["told"]
    assert [mode["mode"] for mode in found["modes"]] == [1, 2, 3, 4]
    assert (files / "model.html").stat().st_size > 10_000
    assert load_rig(model).natural_frequencies.scatter == found["frequency_scatter"]
    status, answer = twin(capsys, "diagnose", files / "changed.npz", "--rig", model, "--out", files / "found")
    assert status == 0
    assert answer["verdict"] == "explained"
    assert answer["causes"][0]["parameters"]["mass"] == "m5"
    assert answer["causes"][0]["parameters"]["position_m"]["value"] == 0.5
    assert "linear causes only" in answer["notes"][0]
    assert (files / "found" / "report.html").exists()


def test_matrices_of_a_rig(files, capsys):
    names = [files / name for name in ("M.op4", "K.op4", "nodes.csv")]
    arguments = ("rig", "export", files / "beam.toml", "--mass", names[0], "--stiffness", names[1], "--nodes", names[2])
    _, found = twin(capsys, *arguments)
    assert found["rows"] == 84
    assert all(name.exists() for name in names)


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (("diagnose", "changed.npz", "--held-out", "intact-0.npz"), "nothing is held out"),
        (("diagnose", "changed.npz", "beam.toml"), "one kind of evidence"),
        (("identify", "changed.npz", "--preload", "9Nm"), "no preload"),
    ],
)
def test_what_does_not_go_together_is_one_line(files, tmp_path, arguments, told):
    command, *rest = [str(files / word) if (files / word).exists() else word for word in arguments]
    out = tmp_path / ("model.toml" if command == "identify" else "found")
    with pytest.raises(InputError, match=told):
        group.main(
            args=[command, *rest, "--rig", str(files / "beam.toml"), "--out", str(out)], prog_name="twin",
            standalone_mode=False,
        )  # fmt: skip


def test_a_scatter_belongs_to_frequency_responses(files, tmp_path):
    table = tmp_path / "table.csv"
    table.write_text("mode,frequency_Hz\n1,15.0\n2,97.0\n")
    with pytest.raises(InputError, match="frequency responses alone"):
        group.main(
            args=["identify", str(table), "--rig", str(files / "beam.toml"), "--frequency-scatter", "0.003", "--out",
                  str(tmp_path / "model.toml")],
            prog_name="twin", standalone_mode=False,
        )  # fmt: skip
