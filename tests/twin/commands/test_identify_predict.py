"""`twin identify` and `twin predict` as other programs call them."""

import csv
import json

import pytest
from said import said_beside_stages

from twin.cli import main
from twin.rigs import Effect, LayerLawTable, load_rig, save_rig


def run(capsys, *arguments):
    """Exit status, standard output and standard error."""
    with pytest.raises(SystemExit) as ended:
        main([str(argument) for argument in arguments])
    captured = capsys.readouterr()
    return ended.value.code, captured.out, captured.err


def table(path):
    """Rows of a CSV file."""
    with path.open() as stream:
        return list(csv.DictReader(stream))


def refused(capsys, out, *arguments):
    """The one line of a refusal that left nothing behind."""
    status, printed, said = run(capsys, *arguments)
    assert status == 2
    assert printed == ""
    assert len(said_beside_stages(said)) == 1
    assert not list(out.parent.glob(out.name + "*"))
    return said


@pytest.mark.slow
def test_recordings_become_a_model_that_predicts(campaign, tmp_path, capsys):
    model, drive, answer = (tmp_path / name for name in ("model.toml", "drive.csv", "response.csv"))
    runs = [campaign / "random.mcap", campaign / "sweeps.mcap"]
    status, printed, _ = run(capsys, "identify", *runs, "--rig", "steel-lap-joint", "--out", model, "--json")
    result = json.loads(printed)
    assert status == 0
    assert set(result["residual_percent"]) == {"1.5N-up", "3N-up", "6N-up"}
    assert result["model"] == str(model)
    assert 0 < result["linear"]["normal_modulus"]["std"] < 0.1 * result["linear"]["normal_modulus"]["value"]
    together = result["nonlinear"]["polynomials"]["all"]
    assert {"lambda", "rho", "eta", "corner", "cross_validated"} <= set(together["l_curve"])
    assert len(together["g1"]["coefficients"]) == together["g1"]["order"] + 1
    assert load_rig(model).joint.law.opening_m == result["nonlinear"]["law"]["opening_m"]

    drive.write_text("frequency_Hz,force_N\n26.3,2\n26.5,2\n")
    status, printed, _ = run(capsys, "predict", model, "--drive", drive, "--out", answer, "--json")
    rows = table(answer)
    assert status == 0
    assert json.loads(printed) == {"rows": len(rows), "branches": max(int(row["branch"]) for row in rows) + 1}
    assert list(rows[0])[:6] == ["frequency_Hz", "force_N", "acceleration_m_per_s2", "std", "branch", "phase_rad"]


def test_an_effect_of_the_model_file_acts(tmp_path, capsys):
    plain = load_rig("steel-lap-joint")
    heavy = Effect(cause="added-mass", parameters={"position_m": 0.42, "mass_kg": 0.02})
    save_rig(plain.model_copy(update={"effect": [heavy]}), tmp_path / "heavy.toml")
    (tmp_path / "drive.csv").write_text("frequency_Hz,force_N\n24.0,1\n")
    values = []
    for model in ("steel-lap-joint", tmp_path / "heavy.toml"):
        run(
            capsys,
            "predict",
            model,
            "--drive",
            tmp_path / "drive.csv",
            "--out",
            tmp_path / "r.csv",
            "--overwrite",
            "--json",
        )
        values.append(float(table(tmp_path / "r.csv")[0]["acceleration_m_per_s2"]))
    assert values[1] > 1.3 * values[0]  # a heavier tip brings mode 1 nearer to 24 Hz


def test_a_joint_that_opens_beyond_its_law_is_told(tmp_path, capsys):
    plain = load_rig("steel-lap-joint")
    law = LayerLawTable(opening_m=[0.0, 5e-7], softening=[0.0, 8e7], slip_m=[0.0, 5e-7], loss=[0.0, 1e8])
    save_rig(plain.model_copy(update={"joint": plain.joint.model_copy(update={"law": law})}), tmp_path / "model.toml")
    (tmp_path / "drive.csv").write_text("frequency_Hz,acceleration_m_per_s2\n26.3,60\n156.5,120\n26.3,1\n")
    out = tmp_path / "r.csv"
    status, _, said = run(capsys, "predict", tmp_path / "model.toml", "--drive", tmp_path / "drive.csv", "--out", out)
    assert status == 0
    assert "warning: 2 of 3 solutions move the joint farther than its law was identified" in said
    far, other, near = (float(row["std"]) / float(row["force_N"]) for row in table(out))
    assert min(far, other) > 10 * near


def test_a_table_of_frequencies_gives_moduli_that_meet_it(tmp_path, capsys):
    measured, model = tmp_path / "frequencies.csv", tmp_path / "model.toml"
    measured.write_text("mode,frequency_Hz\n1,26.50\n2,157.60\n3,471.80\n4,895.00\n")
    status, printed, _ = run(
        capsys, "identify", measured, "--rig", "steel-lap-joint", "--preload", "120N", "--out", model, "--json"
    )
    result = json.loads(printed)
    assert status == 0
    assert result["linear"]["normal_modulus"]["value"] == pytest.approx(3.9e8, rel=0.3)  # the paper has no tip mass
    assert max(abs(error) for error in result["residual_percent"].values()) < 0.2  # the paper: 1.15 %
    assert load_rig(model).joint.preload["540N"] == load_rig("steel-lap-joint").joint.preload["540N"]


@pytest.mark.parametrize(
    ("drive", "place"),
    [
        ("frequency_Hz\n26\n", "line 1"), ("frequency_Hz,force_N\n", "rows"), ("", "empty"),
        ("frequency_Hz,force_N\n26,1\n\n26,x\n", "line 4"), ("frequency_Hz,force_N\n26,-1\n", "line 2"),
        ("frequency_Hz,force_N,acceleration_m_per_s2\n26,1,1\n", "line 1"), ("frequency_Hz,force_N\n26\n", "line 2"),
    ],
)  # fmt: skip
def test_rubbish_drives_are_refused_in_one_line(tmp_path, capsys, drive, place):
    path, out = tmp_path / "drive.csv", tmp_path / "r.csv"
    path.write_text(drive)
    assert place in refused(capsys, out, "predict", "steel-lap-joint", "--drive", path, "--out", out)


def test_other_bad_input_is_refused_in_one_line(campaign, tmp_path, capsys):
    out, text = tmp_path / "model.toml", tmp_path / "text.mcap"
    text.write_text("not a recording")
    one = tmp_path / "one.csv"
    one.write_text("mode,frequency_Hz\n1,26.5\n")
    steel = ("--rig", "steel-lap-joint", "--out", out)
    assert "text.mcap" in refused(capsys, out, "identify", text, *steel)
    assert "99N" in refused(capsys, out, "identify", campaign / "sweeps.mcap", *steel, "--preload", "99N")
    assert "one natural frequency" in refused(capsys, out, "identify", one, *steel)
    assert "by itself" in refused(capsys, out, "identify", one, campaign / "sweeps.mcap", *steel)
    modal = ("--rig", "brake-reuss", "--out", out)
    assert "table of sweeps" in refused(capsys, out, "identify", campaign / "sweeps.mcap", *modal)
    assert "folder" in refused(capsys, out, "identify", one, "--rig", "steel-lap-joint", "--out", out / "model.toml")
    effect = Effect(cause="added-mass", parameters={"mass_kg": 0.02})
    save_rig(load_rig("steel-lap-joint").model_copy(update={"effect": [effect]}), tmp_path / "rig.toml")
    (tmp_path / "drive.csv").write_text("frequency_Hz,force_N\n26,1\n")
    said = refused(capsys, out, "predict", tmp_path / "rig.toml", "--drive", tmp_path / "drive.csv", "--out", out)
    assert "effect.0, added-mass" in said
