"""The reduced rig against the full finite elements, and the shaker's physics."""

from __future__ import annotations

import numpy as np
import pytest
from beam_rows import deflection

from twin.bench import BenchSetup, no_law, open_bench
from twin.rigs import Effect, load_rig, moduli_at
from twin.structure import assemble, normal_modes, with_mass_at

RIG = load_rig("steel-lap-joint")
FREQUENCY = np.array([5.0, 20.0, 26.4, 60.0, 150.0, 157.0, 300.0, 470.0, 700.0])


def channels_of(bench):
    skip = bench.built.locals + bench.built.auxiliaries
    return {c.name: skip + n for n, c in enumerate(bench.channels)}


def full_inertance(structure, E, G, position, drive):
    modes = normal_modes(structure.M, structure.stiffness(E, G))
    ratios = np.array([RIG.damping.modal_ratio[min(r, 3)] for r in range(len(modes.omega))])
    a, b = deflection(structure, position) @ modes.Phi, deflection(structure, drive) @ modes.Phi
    w = 2 * np.pi * FREQUENCY[:, None]
    return np.sum(-(w**2) * a * b / (modes.omega**2 - w**2 + 2j * ratios * modes.omega * w), axis=1)


@pytest.mark.parametrize("channel", ["acc1", "acc2"])
def test_inertance_is_that_of_the_full_elements(channel):
    moduli = RIG.joint.preload["120N"]
    structure = assemble(RIG, layout=RIG.layout(beam_elements=60, layer_elements=6))
    position = next(s.position for s in RIG.sensor if s.channel == channel)
    expected = full_inertance(structure, moduli.normal_modulus, moduli.shear_modulus, position, 0.05)
    bench = open_bench(RIG, joint_law=no_law())
    at, found = channels_of(bench), bench.built.rig(0.0, 51200.0).transfer(FREQUENCY)[:, :, 0]
    # The kept modes alone are wrong by some thousandths between the resonances.
    np.testing.assert_allclose(found[:, at[channel]] / found[:, at["force"]], expected, rtol=2e-4)


@pytest.mark.parametrize("channel", ["acc1", "acc2"])
def test_a_force_without_a_shaker_does_the_same_at_the_resonances(channel):
    """Its derivatives are not known, so what follows it statically is left out."""
    shaken, forced = (
        open_bench(RIG, joint_law=no_law(), setup=BenchSetup(drive=drive)) for drive in ("shaker", "force")
    )
    at = channels_of(shaken)
    G = shaken.built.rig(0.0, 51200.0).transfer(FREQUENCY)[:, :, 0]
    H = forced.built.rig(0.0, 51200.0).transfer(FREQUENCY)[:, :, 0]
    found = G[:, at[channel]] / G[:, at["force"]]
    np.testing.assert_allclose(found, H[:, at[channel]], rtol=0, atol=0.004 * np.abs(found).max())
    np.testing.assert_allclose(found[[2, 5]], H[[2, 5], at[channel]], rtol=2e-3)


@pytest.mark.parametrize("velocities", [False, True], ids=["acceleration", "velocity"])
def test_a_joint_force_moves_the_channels_as_with_all_modes(velocities):
    """What it moves is mostly high modes, of which the kept ones leave a part out."""
    built = open_bench(RIG, setup=BenchSetup(drive="force")).built
    (moduli,) = moduli_at(RIG)
    w = 2 * np.pi * np.array([26.4, 79.2, 157.0])[:, None, None, None]

    def found_with(below_Hz):
        modes = built.condensed.modes([moduli.normal_modulus], [moduli.shear_modulus], below_Hz=below_Hz)
        ratios = np.array([RIG.damping.modal_ratio[min(r, 3)] for r in range(len(modes.omega))])
        out = np.array([row for row, plain in zip(built.channel_rows, built.differentiable, strict=True) if plain])
        out, into = out @ modes.Phi, -np.array([row for row, _ in built.rows]) @ modes.Phi
        each = out[:, None] * into / (modes.omega**2 - w**2 + 2j * ratios * modes.omega * w)
        return np.sum(each, axis=3) * (1j * w[..., 0]) ** (1 if velocities else 2)

    everything, kept = found_with(1e9), found_with(4500.0)
    first = built.locals + built.auxiliaries
    accelerations = [first + n for n, slow in enumerate(built.differentiable) if slow]
    transfer = built.rig(0.0, 51200.0, velocities=velocities).transfer(w.ravel() / 2 / np.pi)
    found = transfer[:, accelerations][:, :, 1 : 1 + len(built.rows)]
    assert np.abs(found - everything).max() < 0.1 * np.abs(kept - everything).max()


def test_velocities_are_the_integrals_of_the_accelerations():
    """Channels are read as velocities where that is faster, and differentiated."""
    bench = open_bench(RIG, joint_law=no_law())
    at = channels_of(bench)["acc1"]
    a, v = (bench.built.rig(0.0, 51200.0, velocities=each).transfer(FREQUENCY)[:, at, 0] for each in (False, True))
    np.testing.assert_allclose(2j * np.pi * FREQUENCY * v, a, rtol=1e-6)


def test_force_drops_at_a_resonance_under_constant_voltage():
    bench = open_bench(RIG, joint_law=no_law())
    at = channels_of(bench)["force"]
    frequency = np.linspace(25.0, 28.0, 601)
    force = np.abs(bench.built.rig(0.0, 51200.0).transfer(frequency)[:, at, 0])
    low = np.argmin(force)
    assert 26.3 < frequency[low] < 26.6
    assert force[low] < 0.95 * force[0]


def test_coil_current_obeys_ohm_at_low_frequency():
    bench = open_bench(RIG, joint_law=no_law(), setup=BenchSetup(monitors=("voltage", "current")))
    G = bench.built.rig(0.0, 51200.0).transfer(np.array([0.5]))[0, :, 0]
    at = channels_of(bench)
    assert G[at["voltage"]] == pytest.approx(1.0)
    assert abs(G[at["current"]]) == pytest.approx(1 / RIG.drive.coil_resistance, rel=0.01)
    assert abs(G[at["force"]]) == pytest.approx(RIG.drive.force_factor / RIG.drive.coil_resistance, rel=0.02)


@pytest.mark.parametrize(
    ("cause", "parameters", "change"),
    [
        ("added-mass", {"position_m": 0.3, "mass_kg": 0.01}, lambda s: with_mass_at(s, s.layout.place(0.3), 0.01)),
        ("drive-mass", {"mass_kg": 0.05}, lambda s: with_mass_at(s, s.layout.place(0.05), 0.05)),
    ],
)
def test_mass_effects_shift_the_modes_as_the_elements_do(cause, parameters, change):
    moduli = RIG.joint.preload["120N"]
    structure = change(assemble(RIG, layout=RIG.layout(beam_elements=60, layer_elements=6)))
    K = structure.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    bench = open_bench(RIG, effects=[Effect(cause=cause, parameters=parameters)])
    found = bench.built.modal(0.0, 51200.0).omega[:4]
    np.testing.assert_allclose(found, normal_modes(structure.M, K, 4).omega, rtol=1e-6)


def test_clamp_compliance_lowers_mode_1_by_the_energy_of_the_root_moment():
    """d omega^2 = -c M0^2 to first order, M0 the root moment of the mass-normalised mode."""
    bench = open_bench(RIG, joint_law=no_law())
    (moduli,) = moduli_at(RIG)
    modes = bench.built.condensed.modes([moduli.normal_modulus], [moduli.shear_modulus], below_Hz=100.0)
    phi = bench.built.condensed.T @ modes.Phi[:, 0]
    c = 1e-7
    yielding = open_bench(
        RIG, effects=[Effect(cause="clamp-compliance", parameters={"rotational_rad_per_Nm": c})], joint_law=no_law()
    )
    x = assemble(RIG, layout=RIG.bench_layout()).meshes["lower"].s[1]
    EI = RIG.lower.youngs_modulus * RIG.lower.second_moment
    moment = EI * (6 * phi[1] / x**2 - 2 * phi[2] / x)
    shift = yielding.built.modal(0.0, 51200.0).omega[0] ** 2 - bench.built.modal(0.0, 51200.0).omega[0] ** 2
    assert shift == pytest.approx(-c * moment**2, rel=0.01)
