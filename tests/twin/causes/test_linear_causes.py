"""Each linear cause in the forward model against the same thing built into dense matrices."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from beam_rows import axial, curvature, deflection
from scipy.integrate import simpson
from scipy.signal import freqs

from twin.diagnose.models import CAUSES
from twin.identify.residuals.residual_model import ResidualModel
from twin.structure import assemble

NEAR = 2e-4
"""Truncation of the model's modes, beside a response's size."""


def departure(found, expected):
    """Errors beside the response, or beside a part of its neighbours where an antiresonance makes it small."""
    size = np.abs(expected)
    around = np.maximum(np.maximum(size, np.roll(size, 1, axis=0)), np.roll(size, -1, axis=0))
    return np.max(np.abs(found - expected) / np.maximum(size, 0.2 * around), axis=0)


@pytest.fixture
def compare(by_hand, baseline, omega):
    """Hold a cause's forward model against a dense response (f, o) that has it."""

    def compare(name, expected, values, *, near=NEAR, spacing_s=0.0, **label):
        evidence = by_hand.evidence(omega, expected, spacing_s=spacing_s)
        cause = CAUSES[name]
        assert label in [dict(known) for known in cause.labels(evidence)]
        values = cause.from_reported(values)
        assert sorted(values) == sorted(p.name for p in cause.parameters(evidence, label))
        named, nominal = (ResidualModel(evidence, cause.modification(evidence, label, values)), ResidualModel(evidence))
        found, unchanged = (p.responses(*p.step_receptance(baseline)[:2]) for p in (named, nominal))
        assert np.all(departure(found, expected) < near)
        # Without the cause the responses are elsewhere, or the comparison would show nothing.
        assert np.max(departure(unchanged, expected)) > 20 * np.max(near)
        if not spacing_s:
            # Broadband responses, all of one time, are predicted alike.
            (_, where), *_ = named.evaluate(baseline).blocks
            left, before = (p.evaluate(baseline).residual[where] for p in (named, nominal))
            assert np.linalg.norm(left) < 0.1 * np.linalg.norm(before)

    return compare


def test_the_base_model_is_the_dense_rig(by_hand, dense, baseline, omega):
    expected = dense.response(omega)
    residual_model = ResidualModel(by_hand.evidence(omega, expected))
    assert np.all(departure(residual_model.responses(*residual_model.step_receptance(baseline)[:2]), expected) < NEAR)


@pytest.mark.parametrize(("position_m", "mass_kg"), [(0.42, 0.006), (0.13, 0.05), (0.29, -0.01)])
def test_added_mass(compare, dense, structure, omega, position_m, mass_kg):
    """It resists along the beam as well as across it."""
    rows = np.array([deflection(structure, position_m), axial(structure, position_m)])
    extra = -(omega[:, None, None] ** 2) * mass_kg * (rows.T @ rows)
    compare("added-mass", dense.response(omega, extra=extra), {"position_m": position_m, "mass_kg": mass_kg})


def test_drive_mass(compare, dense, omega):
    """Only across the beam: the stud slides along it."""
    extra = -(omega[:, None, None] ** 2) * 0.03 * np.outer(dense.drive, dense.drive)
    compare("drive-mass", dense.response(omega, extra=extra), {"mass_kg": 0.03})


def test_stinger_stiffness(compare, dense, omega):
    extra = np.broadcast_to(8e3 * np.outer(dense.drive, dense.drive), (len(omega), *dense.M.shape))
    compare("stinger-stiffness", dense.response(omega, extra=extra), {"stiffness_N_per_m": 8e3})


def test_viscous_damper(compare, dense, structure, omega):
    row = deflection(structure, 0.35)
    extra = 1j * omega[:, None, None] * 0.7 * np.outer(row, row)
    compare("viscous-damper", dense.response(omega, extra=extra), {"damping_Ns_per_m": 0.7, "position_m": 0.35})


def test_attached_resonator(compare, dense, structure, omega):
    """As a degree of freedom of its own: a mass m on a spring k and a dashpot d."""
    m, frequency_Hz, ratio, place = 0.004, 140.0, 0.03, 0.38
    w = 2 * np.pi * frequency_Hz
    k, d = m * w**2, 2 * ratio * m * w
    pull = np.append(deflection(structure, place), -1.0)
    n = len(pull)
    Z = np.zeros((len(omega), n, n), complex)
    s = omega[:, None, None]
    Z[:, :-1, :-1] = dense.K + 1j * s * dense.damping() - s**2 * dense.M
    Z[:, -1, -1] = -m * omega**2
    Z += (k + 1j * s * d) * np.outer(pull, pull)
    x = np.linalg.solve(Z, np.broadcast_to(np.append(dense.drive, 0.0), (len(omega), n))[:, :, None])[:, :-1, 0]
    values = {"mass_kg": m, "frequency_Hz": frequency_Hz, "damping_ratio": ratio, "position_m": place}
    compare("attached-resonator", by_rows(dense, x, omega), values)


def by_rows(dense, x, omega):
    """Readings from all degrees of freedom: two accelerometers, and a velocity looked at from the other side."""
    places = x @ dense.rows.T
    return np.stack([-(omega**2) * places[:, 0], -(omega**2) * places[:, 1], -1j * omega * places[:, 2]], axis=1)


@pytest.mark.parametrize("beam", ["lower", "upper"])
def test_beam_modulus(compare, by_hand, structure, baseline, omega, beam):
    """The block of the stiffness that is the beam's own, scaled."""
    K0 = structure.K0.copy()
    first_upper = 3 * len(structure.meshes["lower"].s) - 3
    own = slice(0, first_upper) if beam == "lower" else slice(first_upper, None)
    K0[own, own] *= 0.95
    dense = by_hand.DenseRig.of(structure, baseline.base, K0=K0)
    compare("beam-modulus", dense.response(omega), {"factor": 0.95}, beam=beam)


@pytest.mark.parametrize("beam", ["lower", "upper"])
def test_transverse_shear(compare, by_hand, structure, baseline, omega, beam):
    """Blocks of a structure all of Timoshenko elements in place of the beam's own."""
    update = {name: getattr(by_hand.rig, name).model_copy(update={"shear_ratio": 40.0}) for name in ("lower", "upper")}
    shearing = assemble(by_hand.rig.model_copy(update=update), sensor_masses=False)
    stiff = assemble(by_hand.rig, sensor_masses=False)
    first_upper = 3 * len(structure.meshes["lower"].s) - 3
    own = slice(0, first_upper) if beam == "lower" else slice(first_upper, None)
    M, K0 = structure.M.copy(), structure.K0.copy()
    M[own, own] += (shearing.M - stiff.M)[own, own]
    K0[own, own] += (shearing.K0 - stiff.K0)[own, own]
    dense = by_hand.DenseRig.of(structure, baseline.base, K0=K0, M=M)
    compare("transverse-shear", dense.response(omega), {"modulus_ratio": 40.0}, beam=beam)


def test_clamp_compliance(compare, by_hand, baseline, omega):
    """A structure that floats, then held at its root but for a rotation against a spring."""
    floating = assemble(by_hand.rig, layout=replace(by_hand.rig.layout(), supports=()))
    compliance = 2e-5
    K0 = floating.K0.copy()
    K0[2, 2] += 1 / compliance
    dense = by_hand.DenseRig.of(floating, baseline.base, K0=K0)
    M, K, damped_by = (matrix[2:, 2:] for matrix in (dense.M, dense.K, dense.damped_by))
    held = replace(dense, M=M, K=K, damped_by=damped_by, drive=dense.drive[2:], rows=dense.rows[:, 2:])
    compare("clamp-compliance", held.response(omega), {"rotational_rad_per_Nm": compliance})


def test_base_motion(compare, by_hand, dense, baseline, omega):
    """The clamp's own degrees of freedom moved by the drive force; the modes are damped as they move against it."""
    floating = assemble(by_hand.rig, layout=replace(by_hand.rig.layout(), supports=()))
    whole = by_hand.DenseRig.of(floating, baseline.base)
    receptance = 4e-7
    load = np.broadcast_to(dense.drive + 0j, (len(omega), len(dense.drive)))
    follows = (whole.K[3:, 1] - omega[:, None] ** 2 * whole.M[3:, 1]) * receptance
    # Dashpots between the structure and its clamp: C acts on what is left of the motion beside the clamp's.
    across = np.zeros(len(whole.M))
    across[1::3] = 1.0
    carried = 1j * omega[:, None] * (dense.damping() @ across[3:]) * receptance
    x = dense.displacement(omega, load - follows + carried)
    # The model leaves out the inertia that the clamped node shares with the first free one: 4e-4 at 900 Hz.
    compare("base-motion", by_rows(dense, x, omega), {"receptance_m_per_N": receptance}, near=1e-3)


def test_joint_stiffness(compare, by_hand, structure, baseline, omega):
    base = replace(baseline.base, E=0.7 * baseline.base.E, G=1.6 * baseline.base.G)
    dense = by_hand.DenseRig.of(structure, base)
    compare("joint-stiffness", dense.response(omega), {"normal_factor": 0.7, "shear_factor": 1.6})


def test_joint_uneven(compare, by_hand, structure, baseline, omega):
    """Every Gauss point of the layer with the modulus of its place: half as much again at the clamp's end."""
    rig, gradient = by_hand.rig, 1.0
    begin = rig.lower.length - rig.joint.overlap
    normal, shear = (
        1 - gradient * ((x - begin) / rig.joint.overlap - 0.5)
        for x in (structure.joints[0].normal.at, structure.joints[0].shear.at)
    )
    assert normal[0] > 1.4 > 0.6 > normal[-1]
    KE, KG = ((B.T * w) @ B for B, w in ((structure.joints[0].B_E, normal), (structure.joints[0].B_G, shear)))
    dense = by_hand.DenseRig.of(structure, baseline.base, KE=KE, KG=KG)
    compare("joint-uneven", dense.response(omega), {"gradient": gradient})


@pytest.mark.parametrize("position_m", [0.058, 0.06, 0.31])
def test_a_small_stiffness_loss(by_hand, dense, structure, baseline, omega, position_m):
    """A little bending stiffness taken off over a section as long as a mean element, by Simpson's rule."""
    rig, factor = by_hand.rig, 0.98
    half = (rig.lower.length + rig.upper.length) / rig.mesh.beam_elements / 2
    x = np.linspace(position_m - half, position_m + half, 401)
    bent = np.array([curvature(structure, at) for at in x])
    EI = rig.lower.youngs_modulus * rig.lower.width * rig.lower.thickness**3 / 12
    lost = (1 - factor) * EI * simpson(bent[:, :, None] * bent[:, None, :], x=x, axis=0)
    expected = dense.response(omega, extra=np.broadcast_to(-lost, (len(omega), *lost.shape)))
    evidence = by_hand.evidence(omega, expected)
    modification = CAUSES["stiffness-loss"].modification(evidence, {}, {"factor": factor, "position_m": position_m})
    named, nominal = (ResidualModel(evidence, modification), ResidualModel(evidence))
    found, unchanged = (p.responses(*p.step_receptance(baseline)[:2]) for p in (named, nominal))
    # Two points do not integrate a curvature that has kinks where the section reaches into the next element.
    left, effect = (np.linalg.norm(values / expected - 1, axis=0) for values in (found, unchanged))
    assert np.all(left < 0.1 * effect)


def test_drive_position(compare, dense, structure, omega):
    moved = dense.having(drive=deflection(structure, 0.05 + 0.004))
    compare("drive-position", moved.response(omega), {"offset_m": 0.004}, channel="force")


@pytest.mark.parametrize(("index", "place", "mass_kg"), [(0, 0.30, 0.002), (1, 0.42, 0.022), (2, 0.21, 0.0)])
def test_sensor_position(compare, by_hand, dense, structure, omega, index, place, mass_kg):
    """It takes its mass along, which the rig file knows of the two accelerometers."""
    rows = dense.rows.copy()
    rows[index] = deflection(structure, place - 0.003)
    here, there = (np.array([deflection(structure, x), axial(structure, x)]) for x in (place, place - 0.003))
    extra = -(omega[:, None, None] ** 2) * mass_kg * (there.T @ there - here.T @ here)
    channel = by_hand.outputs[index].channel
    expected = dense.having(rows=rows).response(omega, extra=extra)
    compare("sensor-position", expected, {"offset_m": -0.003}, channel=channel)


def test_preload_loss(compare, by_hand, structure, baseline, omega):
    """E' falls linearly from the first step on, and so does its loss; G' stays."""
    rate = 2e-3
    base = baseline.base
    rows = [
        by_hand.DenseRig.of(structure, replace(base, E=base.E * (1 - rate * 2.0 * k))).response(omega[k : k + 1])
        for k in range(len(omega))
    ]
    compare("preload-loss", np.concatenate(rows), {"rate_per_s": rate}, spacing_s=2.0)


def test_temperature_drift(compare, by_hand, structure, baseline, omega):
    """All moduli fall by the same part; damping ratios stay.

    The model shifts frequencies instead, which is the same for an acceleration; a velocity is left too small by half
    of what the moduli have fallen by.
    """
    rate = 1e-4
    rows = []
    for k in range(len(omega)):
        left = 1 - rate * 2.0 * k
        parts = {"K0": left * structure.K0, "KE": left * structure.joints[0].KE, "KG": left * structure.joints[0].KG}
        rows.append(by_hand.DenseRig.of(structure, baseline.base, **parts).response(omega[k : k + 1]))
    near = np.array([NEAR, NEAR, 0.6 * (1 - left)])
    compare("temperature-drift", np.concatenate(rows), {"rate_per_s": rate}, spacing_s=2.0, near=near)


def test_sample_clock(compare, dense, omega):
    """A clock too fast by 1000 ppm: what it calls 1000 Hz is 1001 Hz, and the rig moves at that."""
    compare("sample-clock", dense.response(1.001 * omega), {"error_ppm": 1000.0})


CHANNELS = {"acc1": 0, "acc2": 1, "vel": 2, "force": None}


def seen(response, channel, factor):
    """Response per force when one channel is read with a factor (f,): the force's divides all others."""
    out = response.copy()
    if channel == "force":
        return out / factor[:, None]
    out[:, CHANNELS[channel]] *= factor
    return out


@pytest.mark.parametrize("channel", CHANNELS)
def test_channel_gain(compare, dense, omega, channel):
    expected = seen(dense.response(omega), channel, np.full(len(omega), 1.07))
    compare("channel-gain", expected, {"factor": 1.07}, channel=channel)


@pytest.mark.parametrize("channel", CHANNELS)
def test_channel_delay(compare, dense, omega, channel):
    """A late channel's phasor turns backwards."""
    late = np.cos(5e-5 * omega) - 1j * np.sin(5e-5 * omega)
    compare("channel-delay", seen(dense.response(omega), channel, late), {"delay_s": 5e-5}, channel=channel)


@pytest.mark.parametrize("channel", CHANNELS)
def test_channel_polarity(compare, dense, omega, channel):
    expected = seen(dense.response(omega), channel, np.full(len(omega), -1.0))
    compare("channel-polarity", expected, {}, channel=channel)


@pytest.mark.parametrize("channel", CHANNELS)
def test_ac_coupling(compare, dense, omega, channel):
    """A capacitor before a resistor, as a divider: R / (R + 1 / (j omega C))."""
    R = 1e6
    C = 1 / (2 * np.pi * 3.0 * R)
    divided = R / (R + 1 / (1j * omega * C))
    compare("ac-coupling", seen(dense.response(omega), channel, divided), {"corner_Hz": 3.0}, channel=channel)


@pytest.mark.parametrize("channel", ["acc1", "acc2", "vel"])
def test_mounting_resonance(compare, dense, omega, channel):
    """The sensor's motion x over its base's y, by x'' + 2 z w x' + w^2 (x - y) = 0."""
    w, ratio = 2 * np.pi * 2500.0, 0.05
    _, moved = freqs([w**2], [1.0, 2 * ratio * w, w**2], worN=omega)
    values = {"frequency_Hz": 2500.0, "damping_ratio": ratio}
    compare("mounting-resonance", seen(dense.response(omega), channel, moved), values, channel=channel)


def test_a_mount_is_felt_in_proportion_to_the_numbers_that_are_fitted():
    """A score is one step of first order from no mount at all; the damping's lag went by the root of the compliance."""
    cause, omega = CAUSES["mounting-resonance"], 2 * np.pi * np.linspace(20.0, 900.0, 40)
    values = cause.from_reported({"frequency_Hz": 2500.0, "damping_ratio": 0.05})

    def felt(share):
        small = {name: share * value for name, value in values.items()}
        return cause.modification(None, {"channel": "acc1"}, small).channel_factor["acc1"](omega) - 1

    np.testing.assert_allclose(felt(1e-4) * 1e4, felt(1.0), rtol=0.3, atol=0)


@pytest.mark.parametrize(("channel", "source"), [("acc1", "acc2"), ("vel", "acc1"), ("acc2", "force")])
def test_cross_talk(compare, dense, omega, channel, source):
    """A part of the source's reading, per force, is added."""
    response = dense.response(omega)
    leak = np.ones(len(omega)) if source == "force" else response[:, CHANNELS[source]]
    expected = response.copy()
    expected[:, CHANNELS[channel]] += 0.05 * leak
    compare("cross-talk", expected, {"factor": 0.05}, channel=channel, source=source)


def test_two_causes_at_once_are_both_there(by_hand, dense, structure, baseline, omega):
    rows = np.array([deflection(structure, 0.42), axial(structure, 0.42)])
    extra = -(omega[:, None, None] ** 2) * 0.006 * (rows.T @ rows)
    extra = extra + 8e3 * np.outer(dense.drive, dense.drive)
    expected = seen(dense.response(omega, extra=extra), "acc1", np.full(len(omega), 1.07))
    evidence = by_hand.evidence(omega, expected)
    whole = CAUSES["added-mass"].modification(evidence, {}, {"position_m": 0.42, "mass_kg": 0.006})
    whole = whole.merged(CAUSES["stinger-stiffness"].modification(evidence, {}, {"stiffness_N_per_m": 8e3}))
    whole = whole.merged(CAUSES["channel-gain"].modification(evidence, {"channel": "acc1"}, {"factor": 1.07}))
    residual_model = ResidualModel(evidence, whole)
    assert np.all(departure(residual_model.responses(*residual_model.step_receptance(baseline)[:2]), expected) < NEAR)
