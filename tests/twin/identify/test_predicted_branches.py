"""All branches of a folded response, against the harmonic balance of the bench's own model."""

import numpy as np
import pytest
from scipy.interpolate import PchipInterpolator

from twin.bench import open_bench
from twin.diagnose.effects import with_effects
from twin.identify import predict
from twin.identify.predict import RigResponse, blank_evidence
from twin.response import HarmonicBalance
from twin.rigs import Effect, LawTable, load_rig
from twin.structure import assemble, normal_modes

STEEL = load_rig("steel-lap-joint")
HARDENING = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 3e7})
X = np.geomspace(1e-5, 6e-3, 60)


def with_law(softening, loss, effects=(), damping=0.0023):
    table = LawTable(channel="acc2", amplitude_m=list(X), softening=list(softening), loss=list(loss))
    joint = STEEL.joint.model_copy(update={"law": table})
    ratios = STEEL.damping.model_copy(update={"modal_ratio": [damping, 0.002]})
    return STEEL.model_copy(update={"joint": joint, "damping": ratios, "effect": list(effects)})


def balance_crossings(rig, frequencies, force_N):
    """Tip accelerations per frequency along the branch, wherever it crosses it."""
    free = open_bench(rig, drive="force", noise=False, converter=False)
    names = [channel.name for channel in free.channels]
    points = HarmonicBalance(free.built, harmonics=5).branch(26.0, 27.5, force_N, step=0.005)
    f = np.array([point.frequency_Hz for point in points])
    a = np.array([abs(point.channels[names.index("acc2"), 1]) for point in points])
    at = [np.flatnonzero(np.diff(np.sign(f - one))) for one in frequencies]
    return [
        np.sort([a[i] + (a[i + 1] - a[i]) * (one - f[i]) / (f[i + 1] - f[i]) for i in rows])
        for one, rows in zip(frequencies, at, strict=True)
    ]


def test_three_solutions_where_harmonic_balance_has_three():
    rig, force_N, folded = with_law(np.zeros(60), np.zeros(60), [HARDENING]), 3.0, [26.76, 26.80]
    frequencies = np.array([26.05, *folded, 27.4])
    evidence = blank_evidence(rig)
    response = RigResponse(with_effects(evidence))
    found = response.forced(frequencies, np.full(len(frequencies), force_N))
    expected = balance_crossings(rig, frequencies, force_N)
    assert max(len(solutions) for solutions in expected) == 3 == found.branches
    for i, solutions in enumerate(expected):
        rows = found.step == i
        assert found.acceleration_m_per_s2[rows] == pytest.approx(solutions, rel=0.02)
        assert found.stable[rows].tolist() == [True, False, True][: len(solutions)]
        assert found.branch[rows].tolist() == list(range(len(solutions)))


def test_every_solution_solves_the_whole_structure_at_its_own_amplitude():
    """Each of the three by itself: moduli at its amplitude, all degrees of freedom at once, the same amplitude back."""
    softening, loss = 3.3e8 * X**4 / (X**4 + 1.2e-3**4), 3e7 * X / (X + 2e-3)
    rig = with_law(softening, loss, damping=3e-4)
    found = RigResponse(blank_evidence(rig)).forced(np.array([26.14, 26.2, 26.5]), np.full(3, 2.0))
    assert found.branches == 3
    s, moduli = assemble(rig), rig.joint.preload["120N"]
    modes = normal_modes(s.M, s.stiffness(moduli.normal_modulus, moduli.shear_modulus))
    zeta = np.where(np.arange(len(modes.omega)) == 0, 3e-4, 2e-3)
    MPhi = s.M @ modes.Phi[:, :30]
    C = MPhi @ np.diag(2 * zeta[:30] * modes.omega[:30]) @ MPhi.T
    for f, a in zip(found.frequency_Hz, found.acceleration_m_per_s2, strict=True):
        w, amplitude = 2 * np.pi * f, a / modes.omega[0] ** 2
        E = moduli.normal_modulus - PchipInterpolator(X, softening)(amplitude)
        G = moduli.shear_modulus + 1j * PchipInterpolator(X, loss)(amplitude)
        x = np.linalg.solve(s.K0 + E * s.KE + G * s.KG + 1j * w * C - w**2 * s.M, 2.0 * s.deflection(0.05))
        assert abs(w**2 * (s.deflection(0.42) @ x)) == pytest.approx(a, rel=1e-4)


def test_a_root_is_found_by_halving_where_false_position_takes_too_long(monkeypatch):
    rig = with_law(3.3e8 * X**4 / (X**4 + 1.2e-3**4), 3e7 * X / (X + 2e-3), damping=3e-4)
    frequencies, force_N = np.array([26.14, 26.2, 26.5]), np.full(3, 2.0)
    usual = RigResponse(blank_evidence(rig)).forced(frequencies, force_N)
    monkeypatch.setattr(predict, "TURNS", 0)
    halved = RigResponse(blank_evidence(rig)).forced(frequencies, force_N)
    assert halved.step.tolist() == usual.step.tolist()
    np.testing.assert_allclose(halved.acceleration_m_per_s2, usual.acceleration_m_per_s2, rtol=1e-8)


def test_local_forces_that_do_not_settle_are_told(monkeypatch):
    monkeypatch.setattr(predict, "FIXED_TURNS", 1)
    response = RigResponse(with_effects(blank_evidence(with_law(np.zeros(60), np.zeros(60), [HARDENING]))))
    with pytest.warns(RuntimeWarning, match=r"local forces of \d+ of \d+ states did not settle in 1 turns"):
        response.forced(np.array([26.05]), np.array([3.0]))
