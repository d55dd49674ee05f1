"""Nonlinear causes: harmonics against forces sampled in time, their part in the response against dense matrices."""

from __future__ import annotations

import numpy as np
import pytest
from beam_rows import deflection

from twin.diagnose.models import CAUSES
from twin.identify.model_modification import NoiseMotion
from twin.identify.residuals.harmonics import harmonic_residuals
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import jenkins
from twin.structure import layer_points

AMPLITUDES = np.array([2e-5, 1e-4, 3e-4, 1e-3, 4e-3])
T = 2 * np.pi * (np.arange(2048) + 0.5) / 2048
COUNT = 7
OMEGA = 160.0
"""rad/s, near the first resonance."""


def sampled(force, amplitude, omega):
    """Harmonics 1 ... COUNT of force(x, v) for x = a cos(omega t)."""
    x, v = amplitude * np.cos(T), -amplitude * omega * np.sin(T)
    return 2 / len(T) * np.exp(-1j * np.arange(1, COUNT + 1)[:, None] * T) @ force(x, v)


@pytest.fixture(scope="module")
def evidence(by_hand, dense):
    """Steps about the first resonance, large enough for every law to act."""
    omega = 2 * np.pi * np.linspace(25.8, 27.2, 15)
    response = dense.response(omega)
    return by_hand.evidence(omega, response, force=6e-4 * omega**2 / np.abs(response[:, 1]))


LOCAL = {
    "cubic-stiffness": ({"stiffness_N_per_m3": 3e8}, lambda x, v: 3e8 * x**3),
    "ground-friction": ({"force_N": 0.05, "travel_m": 1e-12}, lambda x, v: 0.05 * np.sign(v)),
    "ground-stop": ({"stiffness_N_per_m": 900.0, "gap_m": 2e-4}, lambda x, v: 900.0 * np.maximum(x - 2e-4, 0.0)),
}


@pytest.mark.parametrize("name", LOCAL)
def test_harmonics_are_those_of_the_force_in_time(evidence, name):
    values, force = LOCAL[name]
    (local,) = CAUSES[name].modification(evidence, {}, {**values, "position_m": 0.3}).nonlinear
    found = local.harmonics(AMPLITUDES, COUNT, np.full(len(AMPLITUDES), OMEGA))
    expected = np.array([sampled(force, a, OMEGA) for a in AMPLITUDES])
    size = np.abs(expected[:, :1]) + 1e-12
    assert np.all(np.abs(found - expected) < 1.1e-3 * size)
    equivalent = local.equivalent(AMPLITUDES, np.full(len(AMPLITUDES), OMEGA))
    assert equivalent * AMPLITUDES == pytest.approx(found[:, 0], rel=1e-9, abs=1e-12)


@pytest.mark.parametrize("omega", [OMEGA, 6 * OMEGA], ids=["first mode", "far above it"])
def test_air_drag_takes_the_square_of_the_velocity_over_the_whole_length(evidence, omega):
    """The sum of all places is the whole beam."""
    coefficient = 0.4
    forces = CAUSES["air-drag"].modification(evidence, {}, {"coefficient_Ns2_per_m3": coefficient}).nonlinear
    expected = np.array(
        [sampled(lambda x, v: coefficient * evidence.rig.length * v * np.abs(v), a, omega) for a in AMPLITUDES]
    )
    found = sum(force.harmonics(AMPLITUDES, COUNT, np.full(len(AMPLITUDES), omega)) for force in forces)
    assert np.max(np.abs(found - expected) / np.abs(expected[:, :1])) < 1e-3
    equivalent = sum(force.equivalent(AMPLITUDES, np.full(len(AMPLITUDES), omega)) for force in forces)
    assert equivalent * AMPLITUDES == pytest.approx(expected[:, 0], rel=1e-3)
    # Each acts where it is: a rigid motion across the beams moves all of them alike.
    structure = evidence.model.structure
    rigid = np.zeros(len(structure.basis))
    rigid[1::3] = 1.0
    at_tip = [force.row(structure) @ rigid[structure.free] for force in forces]
    assert at_tip[1:] == pytest.approx(np.ones(len(forces) - 1))


@pytest.mark.parametrize("element", ["1", "2", "3"])
def test_joint_friction_is_a_slider_across_one_elements_slip(evidence, element):
    """The stuck spring and what slipping takes off it are together the slider, marched in time.

    So soft a slider that the structure does not let its slip ripple.
    """
    k, slip = 3e4, 2e-8
    values = {"stiffness_N_per_m": k, "slip_m": slip}
    modification = CAUSES["joint-friction"].modification(evidence, {"layer_element": element}, values)
    (stuck,), (local,) = modification.attachments, modification.nonlinear
    amplitude, omega = slip * np.array([0.5, 1.3, 2.0, 5.0]), np.full(4, 160.0)
    spring = stuck.stiffness(omega)[:, 0]
    found = local.harmonics(amplitude, COUNT, omega)
    assert local.equivalent(amplitude, omega) * amplitude == pytest.approx(found[:, 0], rel=1e-9, abs=1e-9 * k * slip)
    found[:, 0] += spring * amplitude
    t = 2 * np.pi * np.arange(3 * 4096) / 4096
    expected = []
    for a in amplitude:
        force = jenkins(k, k * slip).force_history(a * np.cos(t))[-4096:]
        expected.append(2 * np.fft.rfft(force)[1 : COUNT + 1] / 4096)
    assert np.max(np.abs(found - expected)) < 1e-3 * k * slip
    # Elements count from the clamp's end.
    structure = evidence.model.structure
    row = local.row(structure)
    assert row == pytest.approx(layer_points(structure, 3).slip[int(element) - 1])
    assert stuck.rows(structure)[0] == pytest.approx(row)


def test_a_joint_slider_slips_by_as_much_as_the_beams_slide(evidence):
    """In metres, wherever it is: the upper beam is moved along the lower one."""
    structure = evidence.model.structure
    sliding = np.zeros(len(structure.basis))
    sliding[3 * len(structure.meshes["lower"].s) :: 3] = 1e-6
    for label in CAUSES["joint-friction"].labels(evidence):
        values = {"stiffness_N_per_m": 1e7, "slip_m": 1e-7}
        (local,) = CAUSES["joint-friction"].modification(evidence, label, values).nonlinear
        assert abs(local.row(structure) @ sliding[structure.free]) == pytest.approx(1e-6)


ACTING = {
    "cubic-stiffness": {"stiffness_N_per_m3": 4e7},
    "ground-friction": {"force_N": 0.08, "travel_m": 1e-12},
}


@pytest.mark.parametrize(("name", "drive"), [("cubic-stiffness", 1.5), ("ground-friction", 4.0)])
def test_a_local_force_acts_with_its_equivalent_stiffness(by_hand, dense, structure, baseline, name, drive):
    """The dense rig with that stiffness at the amplitude it then has, found by iterating."""
    values = ACTING[name]
    scale, *_ = (values[key] / LOCAL[name][0][key] for key in values)
    omega = 2 * np.pi * np.linspace(25.8, 27.2, 15)
    row = deflection(structure, 0.3)
    driven = dense.displacement(omega) @ row
    own = dense.displacement(omega, np.tile(row, (len(omega), 1))) @ row
    amplitude = drive * np.abs(driven)
    for _ in range(80):
        first = np.array([sampled(LOCAL[name][1], a, w)[0] for a, w in zip(amplitude, omega, strict=True)])
        k = scale * first / amplitude
        # Half steps: a stiffness that grows with the motion else makes it jump to and fro.
        amplitude = 0.5 * (amplitude + drive * np.abs(driven / (1 + k * own)))
    response = dense.response(omega, extra=k[:, None, None] * np.outer(row, row))
    evidence = by_hand.evidence(omega, response, force=drive)
    residual_model = ResidualModel(evidence, CAUSES[name].modification(evidence, {}, {**values, "position_m": 0.3}))
    found = residual_model.responses(*residual_model.step_receptance(baseline)[:2])
    assert np.max(np.abs(found / response - 1)) < 5e-3
    nominal = ResidualModel(evidence)
    unchanged = nominal.responses(*nominal.step_receptance(baseline)[:2])
    assert np.max(np.abs(unchanged / response - 1)) > 0.1


def test_a_stops_harmonics_reach_the_channels_as_the_dense_rig_carries_them(by_hand, dense, structure, baseline):
    """The response to the negative force at h times the frequency, in the phase of the motion where it strikes."""
    omega = 2 * np.pi * np.linspace(25.8, 27.2, 15)
    response = dense.response(omega)
    rng = np.random.default_rng(4)
    force = 6e-4 * omega**2 / np.abs(response[:, 1]) * np.exp(2j * np.pi * rng.random(len(omega)))
    evidence = by_hand.evidence(omega, response, force=force)
    k, gap, place = 0.5, 2e-4, 0.3
    harmonics = harmonic_residuals(ResidualModel(evidence), baseline)
    values = {"stiffness_N_per_m": k, "gap_m": gap, "position_m": place}
    residual_model = ResidualModel(evidence, CAUSES["ground-stop"].modification(evidence, {}, values), harmonics)
    R, _, balance = residual_model.step_receptance(baseline)
    found = residual_model.extra_harmonics(baseline, R, balance)
    row = deflection(structure, place)
    motion = force * (dense.displacement(omega) @ row)
    for i, h in enumerate(harmonics.orders):
        strikes = np.array([sampled(LOCAL["ground-stop"][1], a, OMEGA)[h - 1] for a in np.abs(motion)]) * k / 900.0
        load = -(strikes * np.exp(1j * h * np.angle(motion)))[:, None] * row
        expected = dense.response(h * omega, load)
        assert np.max(np.abs(found[:, i] - expected)) < 5e-3 * np.max(np.abs(expected))


SIGMA_m, CENTRE = 3e-4, 160.0


@pytest.fixture(scope="module")
def noise():
    """Narrow-band Gaussian motion z(t) of twenty thousand cycles: its real part moves, its imaginary one lags."""
    count, per_cycle = 1_000_000, 50
    rng = np.random.default_rng(5)
    lines = rng.standard_normal(count) + 1j * rng.standard_normal(count)
    envelope = np.fft.ifft(np.where(np.abs(np.fft.fftfreq(count, 1 / per_cycle)) < 0.05, lines, 0))
    envelope *= np.sqrt(2) * SIGMA_m / np.sqrt(np.mean(np.abs(envelope) ** 2))
    return envelope * np.exp(2j * np.pi * np.arange(count) / per_cycle)


def dragged(x, v, *, force, travel):
    """A slider behind a spring, in time."""
    k, held, out = force / travel, 0.0, np.empty(len(x))
    for i, dx in enumerate(np.diff(x, prepend=x[0]).tolist()):
        held = min(max(held + k * dx, -force), force)
        out[i] = held
    return out


UNDER_NOISE = {
    "cubic-stiffness": ({"stiffness_N_per_m3": 3e8}, LOCAL["cubic-stiffness"][1]),
    "ground-stop": (LOCAL["ground-stop"][0], LOCAL["ground-stop"][1]),
    "ground-friction": (
        {"force_N": 0.05, "travel_m": 1e-4},
        lambda x, v: dragged(x, v, force=0.05, travel=1e-4),
    ),
    "air-drag": ({"coefficient_Ns2_per_m3": 0.4}, lambda x, v: 0.4 * v * np.abs(v)),
}


@pytest.mark.parametrize("name", UNDER_NOISE)
def test_the_linear_substitute_is_the_best_one_under_noise(evidence, noise, name):
    """Least squares of the force in time on displacement and velocity."""
    values, force = UNDER_NOISE[name]
    place = {} if name == "air-drag" else {"position_m": 0.3}
    local = CAUSES[name].modification(evidence, {}, {**values, **place}).nonlinear
    x, v = noise.real, -CENTRE * noise.imag
    f = force(x, v)
    expected = np.mean(f * x) / np.mean(x**2) + 1j * CENTRE * np.mean(f * v) / np.mean(v**2)
    motion = NoiseMotion(np.array([CENTRE]), np.array([np.var(x)]))
    each = [one.random(motion, np.array([CENTRE]))[0] for one in local]
    found = sum(each) / (evidence.rig.length if name == "air-drag" else 1.0)
    assert abs(found - expected) < 0.03 * abs(expected)
