"""All branches of a folded response, against the harmonic balance of the bench's own model."""

import numpy as np
import pytest
from beam_rows import deflection
from scipy.interpolate import PchipInterpolator

from twin.bench import BenchSetup, open_bench
from twin.diagnose.effects import with_effects
from twin.identify.forward import predict
from twin.identify.forward.predict import RigResponse, blank_data
from twin.response import HarmonicBalance
from twin.rigs import Effect, LawTable, LayerLawTable, load_rig
from twin.structure import assemble, layer_points, normal_modes

STEEL = load_rig("steel-lap-joint")
HARDENING = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 3e7})
X = np.geomspace(1e-5, 6e-3, 60)
O, Q = np.geomspace(1e-8, 2e-5, 60), np.geomspace(1e-8, 1.5e-5, 60)


def with_law(law, effects=(), damping=0.0023):
    joint = STEEL.joint.model_copy(update={"law": law})
    ratios = STEEL.damping.model_copy(update={"modal_ratio": [damping, 0.002]})
    return STEEL.model_copy(update={"joint": joint, "damping": ratios, "effect": list(effects)})


def layer_law(softening, loss, **std):
    return LayerLawTable(opening_m=list(O), softening=list(softening), slip_m=list(Q), loss=list(loss), **std)


SATURATING = layer_law(3.3e8 * O / (O + 2e-6), 3e9 * Q**2 / (Q**2 + 2.5e-12))


def balance_crossings(rig, frequencies, force_N, *, span=(26.0, 27.5), channel="acc2", step=0.005):
    """Accelerations per frequency along the branch, wherever it crosses it."""
    free = open_bench(rig, setup=BenchSetup(drive="force", noise=False, converter=False))
    names = [channel.name for channel in free.channels]
    points = HarmonicBalance(free.built, harmonics=5).branch(*span, force_N, step=step)
    f = np.array([point.frequency_Hz for point in points])
    a = np.array([abs(point.channels[names.index(channel), 1]) for point in points])
    at = [np.flatnonzero(np.diff(np.sign(f - one))) for one in frequencies]
    return [
        np.sort([a[i] + (a[i + 1] - a[i]) * (one - f[i]) / (f[i + 1] - f[i]) for i in rows])
        for one, rows in zip(frequencies, at, strict=True)
    ]


def test_three_solutions_where_harmonic_balance_has_three():
    """With a law over a sensor's amplitude, as older files have it."""
    nothing = LawTable(channel="acc2", amplitude_m=list(X), softening=[0.0] * 60, loss=[0.0] * 60)
    rig, force_N, folded = with_law(nothing, [HARDENING]), 3.0, [26.76, 26.80]
    frequencies = np.array([26.05, *folded, 27.4])
    evidence = blank_data(rig)
    response = RigResponse(with_effects(evidence))
    found = response.forced(frequencies, np.full(len(frequencies), force_N))
    expected = balance_crossings(rig, frequencies, force_N)
    assert max(len(solutions) for solutions in expected) == 3 == found.branches
    for i, solutions in enumerate(expected):
        rows = found.step == i
        assert found.acceleration_m_per_s2[rows] == pytest.approx(solutions, rel=0.02)
        assert found.stable[rows].tolist() == [True, False, True][: len(solutions)]
        assert found.branch[rows].tolist() == list(range(len(solutions)))


@pytest.mark.parametrize(
    ("frequencies", "span", "force_N"),
    [
        ([26.0, 26.3, 26.35, 26.4, 26.8], (27.0, 25.5), 3.0),
        ([154.0, 155.5, 156.3, 158.0], (160.0, 152.0), 2.0),
        ([468.0, 470.3, 471.0, 473.0], (476.0, 465.0), 4.0),
    ],
    ids=["mode 1", "mode 2", "mode 3"],
)
def test_one_law_of_the_layer_holds_about_every_mode(frequencies, span, force_N):
    """The bench marches the law's time form with all its harmonics; those of the slip are not in the prediction."""
    rig = with_law(SATURATING)
    for channel in ("acc1", "acc2"):
        response = RigResponse(blank_data(rig), channel=channel)
        found = response.forced(np.array(frequencies), np.full(len(frequencies), force_N))
        assert response.channel == channel
        expected = balance_crossings(rig, frequencies, force_N, span=span, channel=channel, step=0.02)
        np.testing.assert_allclose(found.acceleration_m_per_s2, np.concatenate(expected), rtol=0.01)
        assert not found.unseen.any()
        assert not found.unsettled.any()
        held = response.held(found.frequency_Hz, found.acceleration_m_per_s2)
        np.testing.assert_allclose(held.force_N, force_N, rtol=1e-7)
        np.testing.assert_allclose(held.phase_rad, found.phase_rad, atol=1e-7)


def test_every_solution_solves_the_whole_structure_at_its_own_amplitude():
    """Each of the three by itself: the points' moduli at their own motion, all degrees of freedom at once."""
    law = layer_law(3.5e8 * O / (O + 1e-6), 3e7 * Q / (Q + 1e-6))
    rig = with_law(law, damping=3e-4)
    response = RigResponse(blank_data(rig), own_harmonics=False)
    found = response.forced(np.array([26.14, 26.2, 26.5]), np.full(3, 2.0))
    assert found.branches == 3
    s, moduli = assemble(rig), rig.joint.preload["120N"]
    points = layer_points(s, 3)
    modes = normal_modes(s.M, s.stiffness(moduli.normal_modulus, moduli.shear_modulus))
    zeta = np.where(np.arange(len(modes.omega)) == 0, 3e-4, 2e-3)
    MPhi = s.M @ modes.Phi[:, :30]
    C = MPhi @ np.diag(2 * zeta[:30] * modes.omega[:30]) @ MPhi.T
    K = s.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    softening, loss = PchipInterpolator(O, law.softening), PchipInterpolator(Q, law.loss)
    for f, a in zip(found.frequency_Hz, found.acceleration_m_per_s2, strict=True):
        w = 2 * np.pi * f
        k = np.zeros(6, complex)
        # In step with the sensor's amplitude there is one solution, to which half steps lead.
        for _ in range(60):
            Z = K + (points.rows.T * (points.weights * k)) @ points.rows + 1j * w * C - w**2 * s.M
            x = np.linalg.solve(Z, 2.0 * deflection(s, 0.05))
            motion = np.abs(points.rows @ x) * a / abs(w**2 * (deflection(s, 0.42) @ x))
            moved = np.concatenate([
                -softening(np.clip(motion[:3], O[0], O[-1])) + 0j, 1j * loss(np.clip(motion[3:], Q[0], Q[-1]))
            ])  # fmt: skip
            k = (k + moved) / 2
        assert abs(w**2 * (deflection(s, 0.42) @ x)) == pytest.approx(a, rel=1e-4)


def test_a_motion_beyond_the_law_is_told_and_wide():
    """The same model about modes 1 and 2: where a mode opens the joint farther than was seen, nobody knows."""
    std = {"softening_std": [1e6] * 60, "loss_std": [1e7] * 60}
    seen = layer_law(3.3e8 * O / (O + 2e-6), 3e9 * Q**2 / (Q**2 + 2.5e-12), **std)
    response = RigResponse(blank_data(with_law(seen)))
    inside = response.held(np.array([26.3, 156.0]), np.array([40.0, 90.0]))
    assert not inside.unseen.any()
    assert np.all(inside.std / inside.force_N < 0.02)
    short = {name: getattr(seen, name)[:31] for name in ("opening_m", "softening", "slip_m", "loss", *std)}
    blind = RigResponse(blank_data(with_law(LayerLawTable(**short))))
    outside = blind.held(np.array([26.3, 156.0, 26.3]), np.array([40.0, 90.0, 2.0]))
    assert outside.unseen.tolist() == [True, True, False]
    assert np.all(outside.beyond[:2] > 2)
    assert np.all(outside.std[:2] > 5 * inside.std)
    assert outside.std[2] / outside.force_N[2] < 0.02


@pytest.mark.slow
def test_thousands_of_steps_at_once():
    f = np.linspace(25.0, 28.0, 300)
    found = RigResponse(blank_data(with_law(SATURATING))).forced(np.tile(f, 4), np.repeat([0.5, 1.5, 3.0, 6.0], 300))
    assert np.all(np.bincount(found.step, minlength=1200) % 2 == 1)
    assert not found.unsettled.any()


def test_a_root_is_found_by_halving_where_false_position_takes_too_long(monkeypatch):
    frequencies, force_N = np.array([26.14, 26.2, 26.5]), np.full(3, 2.0)
    usual = RigResponse(blank_data(with_law(SATURATING))).forced(frequencies, force_N)
    monkeypatch.setattr(predict, "TURNS", 0)
    halved = RigResponse(blank_data(with_law(SATURATING))).forced(frequencies, force_N)
    assert halved.step.tolist() == usual.step.tolist()
    np.testing.assert_allclose(halved.acceleration_m_per_s2, usual.acceleration_m_per_s2, rtol=1e-8)


def test_uncertain_damping_of_a_mode_widens_what_is_foretold_about_it_alone():
    """By as much as the force changes where the damping ratio does."""
    rig = with_law(SATURATING)

    def damped(ratio, std):
        damping = rig.damping.model_copy(update={"modal_ratio": [0.0023, ratio], "modal_ratio_std": [0.0, std]})
        return RigResponse(blank_data(rig.model_copy(update={"damping": damping})))

    frequencies, acceleration = np.array([26.2, 154.9, 155.5, 156.0]), np.full(4, 3.0)
    known, unsure, more = (damped(*z).held(frequencies, acceleration) for z in ((2e-3, 0), (2e-3, 1e-4), (2.01e-3, 0)))
    by_std = np.sqrt(unsure.std**2 - known.std**2)
    assert by_std[0] < 1e-3 * known.std[0]
    by_ratio = np.abs(more.force_N - known.force_N) * (1e-4 / 1e-5)
    np.testing.assert_allclose(by_std[1:], by_ratio[1:], rtol=0.02, atol=1e-3 * known.std[1:].min())
    assert np.max(by_std / known.force_N) > 0.005
