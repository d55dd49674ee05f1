"""Sweeps against a smooth law: a clean one passes, a drift is told from amplitude, a real beam's shift is shown."""

from pathlib import Path

import numpy as np
import pytest

from recordings.errors import InputError
from twin.diagnose.tables import diagnose_sweeps
from twin.identify.backbones.backbone import BackboneSweep
from twin.identify.backbones.modal_table import read_sweeps

TABLE = Path(__file__).parents[3] / "data" / "brake-reuss" / "response_control.csv"
AMPLITUDES = (40, 5, 25, 60, 15, 50, 10, 30, 20, 45)


def sweeps(amplitudes, *, shift_Hz=lambda k: 0.0, seed=0):
    """One mode by its textbook receptance, softening by 0.4 Hz at 60 m/s2, forces and phases with 0.5 % of noise."""
    generator = np.random.default_rng(seed)
    made = []
    for k, A in enumerate(amplitudes):
        f = np.linspace(49, 51, 41)
        W, w = 2 * np.pi * (50 - 0.4 * (A / 60) ** 2 + shift_Hz(k)), 2 * np.pi * f
        zeta = 0.002 + 0.002 * A / 60
        H = 1 / (1.7 * (W**2 - w**2 + 2j * zeta * W**2))
        H = H * np.exp(0.005 * (generator.standard_normal(41) + 1j * generator.standard_normal(41)))
        made.append(BackboneSweep(str(k), f, A / (w**2 * np.abs(H)), np.full(41, float(A)), np.angle(H)))
    return made


def diagnose(made, **options):
    return diagnose_sweeps(made, path="table.csv", rig_name="made", **options)


@pytest.fixture(scope="module")
def beam():
    return diagnose_sweeps(read_sweeps(TABLE), path=TABLE, rig_name="brake-reuss")


def test_a_clean_law_of_amplitude_explains_its_sweeps():
    for seed in range(3):
        found = diagnose(sweeps(AMPLITUDES, seed=seed))
        assert (found.verdict, found.causes) == ("none", ())
        assert found.misfit.chi2_per_dof < found.misfit.threshold


@pytest.mark.slow
def test_a_joint_that_softens_from_sweep_to_sweep_is_told_from_the_law_of_amplitude():
    found = diagnose(sweeps(AMPLITUDES, shift_Hz=lambda k: -0.03 * k))
    assert found.verdict == "ambiguous"
    assert {cause.cause for cause in found.causes} == {"preload-loss", "temperature-drift"}
    rate = found.causes[0].parameters["shift_Hz_per_sweep"]
    assert abs(rate.value + 0.03) < 4 * rate.std < 0.01
    assert found.gain.after < 0.5 * found.gain.before
    assert found.misfit.after < 0.2 * found.misfit.chi2_per_dof


def test_a_resonance_that_rises_is_no_loss_of_preload():
    found = diagnose(sweeps(AMPLITUDES, shift_Hz=lambda k: 0.03 * k))
    assert [(cause.cause, cause.confused_with) for cause in found.causes] == [("temperature-drift", ())]
    assert found.verdict == "explained"


def test_sweeps_in_order_of_amplitude_cannot_tell_a_drift_and_say_so():
    found = diagnose(sweeps(sorted(AMPLITUDES), shift_Hz=lambda k: -0.01 * k))
    assert found.causes == ()
    assert any("cannot be told apart" in note for note in found.notes)


@pytest.mark.slow
def test_a_lasting_jump_is_seen_and_named_by_no_cause():
    found = diagnose(sweeps(AMPLITUDES, shift_Hz=lambda k: -0.15 * (k >= 6)))
    assert (found.verdict, found.causes) == ("unknown", ())
    assert "before sweep 6 and stays there" in found.sentence
    assert any("lasting jump of -0.1" in note and "before sweep 6" in note for note in found.notes)


def test_the_brake_reuss_beam_keeps_a_shift_that_no_smooth_law_explains(beam):
    assert (beam.verdict, beam.causes) == ("unknown", ())
    shifted = [row for row in beam.rows if row.shifted]
    assert [row.sweep for row in shifted] == ["3"]
    assert shifted[0].shift_Hz == pytest.approx(-0.08, abs=0.01)
    assert shifted[0].force_error > 3 * shifted[0].own_error
    assert beam.misfit.where[0]["sweep"] == "3"
    assert beam.misfit.where[0]["share"] > 0.7
    assert beam.misfit.chi2_per_dof > beam.misfit.threshold
    assert beam.gain.before == beam.gain.after > 2 * beam.gain.noise_floor


def test_each_sweep_alone_is_the_mode_that_its_largest_receptance_says(beam):
    """Checked on the table itself: the resonance lies where acceleration over force is largest, to a step or two."""
    for row, sweep in zip(beam.rows, read_sweeps(TABLE), strict=True):
        peak = sweep.frequency_Hz[np.argmax(sweep.acceleration_m_per_s2 / sweep.force_N)]
        assert row.frequency_Hz == pytest.approx(peak, abs=0.12)


def test_held_out_sweeps_are_predicted_by_the_law_of_the_others():
    made = sweeps(AMPLITUDES)
    found = diagnose(made[:-1], held_out=made[-1:], held_out_paths=["kept/last.csv"])
    assert found.gain.runs == ("last.csv",)
    assert found.gain.sweeps == ("9",)
    assert found.gain.before < 0.02


@pytest.mark.slow
def test_velocities_and_displacements_are_accelerations(tmp_path, beam):
    data = np.genfromtxt(TABLE, delimiter=",", names=True)
    for column, power in (("velocity_m_per_s", 1), ("displacement_m", 2)):
        path = tmp_path / f"{column}.csv"
        response = data["acceleration_m_per_s2"] / (2 * np.pi * data["frequency_Hz"]) ** power
        rows = np.column_stack([data["level"], data["frequency_Hz"], data["force_N"], response, data["phase_rad"]])
        header = f"level,frequency_Hz,force_N,{column},phase_rad"
        np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.10g")
        again = diagnose_sweeps(read_sweeps(path), path=path, rig_name="brake-reuss")
        assert again.misfit.chi2_per_dof == pytest.approx(beam.misfit.chi2_per_dof, rel=1e-3)


def test_sweeps_that_did_not_hold_their_response_are_refused():
    made = sweeps(AMPLITUDES)
    first = made[0]
    made[0] = BackboneSweep(first.level, first.frequency_Hz, first.force_N, np.linspace(5, 20, 41), first.phase_rad)
    with pytest.raises(InputError, match="sweep 0"):
        diagnose(made)
    with pytest.raises(InputError, match="at least five"):
        diagnose(made[1:4])
