"""Amplitude-dependent modes: a known law comes back, all branches are found, the Brake-Reuss beam is predicted."""

from functools import partial
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from recordings.errors import InputError
from twin.identify.backbones import backbone
from twin.identify.backbones.backbone import BackboneSweep, identify_backbone
from twin.identify.backbones.drive_table import write_response
from twin.identify.backbones.modal_prediction import modal_receptance, predict_forced, predict_held
from twin.identify.backbones.modal_table import identify_sweep_table, read_sweeps
from twin.identify.backbones.robust_curve import fit_robust_curve
from twin.lab import load_rig
from twin.rigs.modal import ModalLaw
from twin.rigs.store import load_any_rig, save_rig

TABLE = Path(__file__).parents[3] / "data" / "brake-reuss" / "response_control.csv"


@pytest.fixture(scope="module")
def beam():
    return identify_backbone(sorted(read_sweeps(TABLE), key=lambda sweep: sweep.amplitude), name="brake-reuss")


def law(**change):
    knots = np.linspace(0, 60, 13)
    table = {
        "modal_mass_kg": 1.7, "residual": -2.0, "phase_rad": 0.02, "amplitude_m_per_s2": knots.tolist(),
        "frequency_Hz": (50 - 0.4 * (knots / 60) ** 2).tolist(),
        "damping_ratio": (0.002 + 0.002 * knots / 60).tolist(),
        "frequency_std_Hz": [0.01] * 13, "damping_relative_std": [0.02] * 13, "force_relative_std": 0.01,
    }  # fmt: skip
    return ModalLaw.model_validate({**table, **change})


def sweeps(source, levels, *, noise=0.0, seed=0):
    generator = np.random.default_rng(seed)
    made = []
    for A in levels:
        f = np.linspace(49, 51, 41)
        H = modal_receptance(source, f, np.full(41, A))
        H = H * np.exp(noise * (generator.standard_normal(41) + 1j * generator.standard_normal(41)))
        made.append(
            BackboneSweep(f"{A:g}", f, A / ((2 * np.pi * f) ** 2 * np.abs(H)), np.full(41, float(A)), np.angle(H))
        )
    return made


def test_a_known_law_comes_back_from_noisy_sweeps():
    true = law()
    found = identify_backbone(sweeps(true, (5, 15, 25, 35, 45, 55), noise=0.01), name="made")
    A = np.array([10.0, 30.0, 50.0])
    assert found.law.modal_mass_kg == pytest.approx(1.7, rel=5e-3)
    knots = found.law.amplitude_m_per_s2
    assert np.interp(A, knots, found.law.frequency_Hz) == pytest.approx(50 - 0.4 * (A / 60) ** 2, abs=2e-3)
    assert np.interp(A, knots, found.law.damping_ratio) == pytest.approx(0.002 + 0.002 * A / 60, rel=0.02)
    assert not any(level.shifted for level in found.level)
    assert all(level.left_out_force_rms < 0.03 for level in found.level[1:-1])


def test_a_sweep_that_was_shifted_is_named_and_does_not_bend_the_law():
    true = law()
    shifted = law(frequency_Hz=[f - 0.08 for f in true.frequency_Hz])
    levels = (5, 13, 21, 29, 37, 45, 53)
    made = sweeps(true, levels, noise=0.005)
    made[3] = sweeps(shifted, levels, noise=0.005)[3]
    found = identify_backbone(made, name="made")
    assert [level.level for level in found.level if level.shifted] == ["29"]
    assert any("sweep 29" in note for note in found.note)
    assert np.interp(29, found.law.amplitude_m_per_s2, found.law.frequency_Hz) == pytest.approx(
        50 - 0.4 * (29 / 60) ** 2, abs=0.015
    )


def test_order_of_the_curve_is_chosen_by_prediction():
    x = np.linspace(1, 10, 9)
    generator = np.random.default_rng(4)
    line = fit_robust_curve(x, 2 + 3 * x + 0.05 * generator.standard_normal(9), scale=0.05)
    cubic = fit_robust_curve(x, x**3 - 9 * x**2 + 0.05 * generator.standard_normal(9), scale=0.05)
    assert len(cubic.coefficients) == 4
    assert 2 <= len(line.coefficients) < 4
    assert abs(line(5.0) - 17) < 4 * line.std(5.0)[0]


def test_all_three_branches_of_a_softening_mode_are_found_and_only_two_are_stable():
    knots = np.linspace(0, 60, 13)
    soft = law(frequency_Hz=(50 - 2 * (knots / 60) ** 2).tolist(), damping_ratio=[0.002] * 13)
    response = predict_forced(soft, np.linspace(48.5, 50.2, 101), np.full(101, 0.3))
    assert response.branches == 3
    for i in np.unique(response.step):
        rows = response.step == i
        assert response.branch[rows].tolist() == list(range(rows.sum()))
        assert np.all(np.diff(response.acceleration_m_per_s2[rows]) > 0)
        if rows.sum() == 3:
            assert response.stable[rows].tolist() == [True, False, True]
    assert np.all(response.std <= response.acceleration_m_per_s2)


def test_predicted_force_and_acceleration_are_inverse_to_each_other():
    source = law()
    f = np.linspace(49, 51, 21)
    held = predict_held(source, f, np.full(21, 30.0))
    back = predict_forced(source, f, held.force_N)
    nearest = [np.min(np.abs(back.acceleration_m_per_s2[back.step == i] - 30.0)) for i in range(21)]
    assert max(nearest) < 0.02


def test_duffing_oscillator_marched_in_time_lies_on_the_predicted_branch():
    """x'' + 2 z w x' + w^2 x + c x^3 = F cos; its describing function against solve_ivp."""
    W, zeta, cubic, m = 2 * np.pi * 5.0, 0.02, 4e4, 1.0
    knots = np.linspace(0, 40, 81)
    x = np.zeros_like(knots)
    for _ in range(60):  # amplitude of displacement at resonance, where a = W(x)^2 x
        x = knots / (W**2 + 0.75 * cubic * x**2)
    effective = np.sqrt(W**2 + 0.75 * cubic * x**2)
    source = law(
        modal_mass_kg=m, residual=0.0, phase_rad=0.0, amplitude_m_per_s2=knots.tolist(),
        frequency_Hz=(effective / (2 * np.pi)).tolist(), damping_ratio=(zeta * (W / effective) ** 1).tolist(),
        frequency_std_Hz=[0.0] * 81, damping_relative_std=[0.0] * 81,
    )  # fmt: skip
    drive, F = 5.05, 1.0
    w = 2 * np.pi * drive
    marched = solve_ivp(
        lambda t, y: [y[1], F * np.cos(w * t) - 2 * zeta * W * y[1] - W**2 * y[0] - cubic * y[0] ** 3],
        (0, 30), [0.0, 0.0], rtol=1e-8, atol=1e-10, t_eval=30 - np.arange(200)[::-1] / 200 / drive,
    )  # fmt: skip
    amplitude = 2 * abs(np.mean(marched.y[0] * np.exp(-1j * w * marched.t))) * w**2
    response = predict_forced(source, np.array([drive]), np.array([F]))
    assert np.min(np.abs(response.acceleration_m_per_s2 / amplitude - 1)) < 0.02


def test_brake_reuss_interior_levels_are_predicted_from_the_others(beam):
    """0.02 Hz and 5 % at the interior levels, except where no smooth law can: that sweep must be named."""
    inner = beam.level[1:-1]
    smooth = [level for level in inner if not level.shifted]
    assert [level.level for level in inner if level.shifted] == ["3"]
    error = np.array([level.left_out_frequency_error_Hz for level in smooth])
    assert np.sqrt(np.mean(error**2)) < 0.02
    assert np.abs(error).max() < 0.03
    force = np.array([level.left_out_force_rms for level in smooth])
    assert np.sqrt(np.mean(force**2)) < 0.05
    assert any("shifted" in note and "sweep 3" in note for note in beam.note)


def test_brake_reuss_bands_hold_the_measured_sweeps(beam):
    d = np.genfromtxt(TABLE, delimiter=",", names=True)
    held = predict_held(beam.law, d["frequency_Hz"], d["acceleration_m_per_s2"])
    inside = np.abs(held.force_N - d["force_N"]) < 2 * held.std
    assert np.mean(inside) > 0.85
    assert np.median(held.std / held.force_N) < 0.08, "bands that hold everything by being wide say nothing"


def test_brake_reuss_intervals_hold_any_two_sweeps_left_out():
    """The lowest, the highest and the shifted one among them: 85 to 99 % of all steps lie in 95 % intervals."""
    measured = sorted(read_sweeps(TABLE), key=lambda sweep: sweep.amplitude)
    inside = []
    for pair in combinations(measured, 2):
        law = identify_backbone([sweep for sweep in measured if sweep not in pair], name="brake-reuss").law
        for sweep in pair:
            held = predict_held(law, sweep.frequency_Hz, sweep.acceleration_m_per_s2)
            inside.append(np.abs(held.force_N - sweep.force_N) < 1.96 * held.std)
    assert len(inside) == 56
    assert 0.85 < np.mean(inside) < 0.99


def test_a_modal_model_survives_its_file_and_rubbish_is_refused(beam, tmp_path):
    path = tmp_path / "model.toml"
    save_rig(beam, path)
    assert load_any_rig(path) == beam
    path.write_text(path.read_text().replace("modal_mass_kg = ", "modal_mass_kg = -"))
    with pytest.raises(InputError, match=r"law\.modal_mass_kg"):
        load_any_rig(path)


def test_too_few_sweeps_are_refused():
    with pytest.raises(ValueError, match="four sweeps"):
        identify_backbone(sweeps(law(), (5, 15, 25)), name="few")


@pytest.mark.parametrize("convention", ["acceleration", "lead", "none"])
def test_other_conventions_of_the_phase_and_none_at_all_give_the_same_mode(convention):
    turn = {"acceleration": lambda p: p + np.pi, "lead": lambda p: -p, "none": lambda p: p * np.nan}[convention]
    made = [
        BackboneSweep(s.level, s.frequency_Hz, s.force_N, s.acceleration_m_per_s2, turn(s.phase_rad))
        for s in sweeps(law(), (5, 15, 25, 35, 45, 55), noise=0.003)
    ]
    found = identify_backbone(made, name="made")
    assert np.interp(30, found.law.amplitude_m_per_s2, found.law.frequency_Hz) == pytest.approx(49.9, abs=3e-3)
    assert np.interp(30, found.law.amplitude_m_per_s2, found.law.damping_ratio) == pytest.approx(0.003, rel=0.03)


def test_table_to_model_to_response(tmp_path):
    model = identify_sweep_table(TABLE, load_any_rig("brake-reuss"))
    assert model.name == "brake-reuss"
    save_rig(model, tmp_path / "model.toml")
    response = load_rig(tmp_path / "model.toml").predict(np.linspace(79.5, 81, 31), force_N=1.0).response
    write_response(response, tmp_path / "response.csv")
    table = np.genfromtxt(tmp_path / "response.csv", delimiter=",", names=True)
    assert table.dtype.names[:5] == ("frequency_Hz", "force_N", "acceleration_m_per_s2", "std", "branch")
    assert 50 < table["acceleration_m_per_s2"].max() < 65, "the 60 m/s2 sweep needed 1.1 N at resonance"
    assert set(np.unique(table["branch"])) <= {0, 1, 2}
    assert [p.name for p in tmp_path.iterdir() if p.suffix == ".part"] == []


def test_a_rig_without_a_law_cannot_predict():
    with pytest.raises(InputError, match="identify it"):
        load_rig("brake-reuss").predict([80.0], force_N=1.0)


def test_a_fit_that_does_not_settle_says_how_far_it_came(monkeypatch):
    monkeypatch.setattr(backbone, "least_squares", partial(backbone.least_squares, max_nfev=1))
    with pytest.raises(ArithmeticError, match=r"did not settle in 1 trials, cost \d"):
        identify_backbone(sweeps(law(), (5, 20, 35, 50)), name="made")
