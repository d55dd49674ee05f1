"""The shaker and its amplifier against Ohm, Fourier and Newton: what they hold, where they end, what they distort."""

from __future__ import annotations

import numpy as np
import pytest
from beam_rows import axial, slope
from march_numpy import march_numpy

from recordings.streams import Excitation
from twin.bench import BenchSetup, no_law, open_bench
from twin.bench.marching import integrate
from twin.response import HarmonicBalance
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes

RIG = load_rig("steel-lap-joint")
RATE = 2048
LIMITED = {"voltage_limit": 2.5, "current_limit": 1.2, "stroke_limit": 1e-5, "half_force_stroke": 2e-5}


def rig(**drive):
    """With other data of the drive, and sensors without high-passes."""
    sensors = [s.model_copy(update={"high_pass": 0.0}) for s in RIG.sensor]
    return RIG.model_copy(update={"drive": RIG.drive.model_copy(update=drive), "sensor": sensors})


def channels(bench):
    return {c.name: bench.built.locals + bench.built.auxiliaries + n for n, c in enumerate(bench.channels)}


def record(volts, frequency_Hz, **drive):
    bench = open_bench(
        rig(**drive), joint_law=no_law(), sample_rate_Hz=RATE,
        setup=BenchSetup(noise=False, converter=False, monitors=("voltage", "current", "stroke")),
    )  # fmt: skip
    bench.set_output(Excitation(kind="sine", amplitude_V=volts, frequency_Hz=frequency_Hz))
    bench.read(8 * RATE)
    return {name: values.astype(float) for name, values in bench.read(RATE).samples.items()}


def harmonic(values, frequency_Hz, order):
    t = np.arange(len(values)) / RATE
    return 2 * abs(np.mean(values * np.exp(-2j * np.pi * order * frequency_Hz * t)))


def test_a_current_amplifier_holds_the_current_through_a_resonance_where_the_other_does_not():
    frequency = np.linspace(25.5, 27.5, 201)
    spread = {}
    for amplifier in ("voltage", "current"):
        bench = open_bench(rig(amplifier=amplifier), joint_law=no_law(), setup=BenchSetup(monitors=("current",)))
        current = abs(bench.built.rig(0.0, 51200.0).transfer(frequency)[:, channels(bench)["current"], 0])
        spread[amplifier] = np.ptp(current) / current.mean()
        if amplifier == "current":
            np.testing.assert_allclose(current, 1.0, rtol=2e-3)  # A per V
    assert spread["current"] < 0.01 * spread["voltage"]


def test_a_voltage_limit_clips_the_sine():
    """Far below the resonance the coil obeys Ohm, so that the current has the harmonics of a clipped sine."""
    values = record(3.0, 4.0, voltage_limit=2.0)
    r, R = 2.0 / 3.0, RIG.drive.coil_resistance
    first = 2 / np.pi * 3.0 * (np.arcsin(r) + r * np.sqrt(1 - r**2)) / R
    assert harmonic(values["current"], 4.0, 1) == pytest.approx(first, rel=5e-3)
    third = 4 / np.pi * 3.0 * r * (1 - r**2) ** 1.5 / 3 / R  # of a sine clipped at its share r
    assert harmonic(values["current"], 4.0, 3) == pytest.approx(third, rel=0.02)
    assert harmonic(values["voltage"], 4.0, 3) < 1e-3  # the generator itself is clean


@pytest.mark.parametrize("amplifier", ["voltage", "current"])
def test_current_and_rated_force_are_not_exceeded(amplifier):
    assert abs(record(3.0, 4.0, amplifier=amplifier)["current"]).max() > 1.9
    limited = record(3.0, 4.0, amplifier=amplifier, current_limit=1.5)
    assert abs(limited["current"]).max() == pytest.approx(1.5, rel=0.01)
    rated = record(3.0, 4.0, amplifier=amplifier, current_limit=1.5, force_limit=5.5)
    assert abs(rated["current"]).max() == pytest.approx(1.0, rel=0.02)


def test_end_stops_hold_the_armature():
    free = abs(record(8.0, 4.0)["stroke"]).max()
    stopped = abs(record(8.0, 4.0, stroke_limit=free / 2, stop_stiffness=6e6)["stroke"]).max()
    assert free / 2 < stopped < 0.6 * free


def test_the_coil_pushes_with_the_force_factor_of_its_place():
    """Newton on the armature, sample by sample: Bl/(1 + (x/x_half)^2) i = k_s x + F, and inertia."""
    half = 4e-5
    values = record(6.0, 4.0, half_force_stroke=half)
    x, d = values["stroke"], RIG.drive
    assert abs(x).max() > 0.4 * half
    inertia = -d.armature_mass * (2 * np.pi * 4.0) ** 2 * x
    pushed = d.suspension_stiffness * x + values["force"] + inertia
    np.testing.assert_allclose(pushed, d.force_factor / (1 + (x / half) ** 2) * values["current"], atol=2e-3 * 22)
    third = harmonic(values["force"], 4.0, 3) / harmonic(values["force"], 4.0, 1)
    plain = record(6.0, 4.0)
    assert third > 0.01
    assert harmonic(plain["force"], 4.0, 3) < 1e-3 * harmonic(plain["force"], 4.0, 1)


@pytest.mark.parametrize("drive", [LIMITED, {**LIMITED, "amplifier": "current"}], ids=["voltage", "current"])
def test_compiled_and_plain_march_agree_in_all_limits(drive, monkeypatch):
    samples = []
    for kernel in (integrate, march_numpy):
        monkeypatch.setattr("twin.bench.bench.integrate", kernel)
        bench = open_bench(rig(**drive), sample_rate_Hz=RATE, setup=BenchSetup(noise=False, converter=False))
        bench.set_output(Excitation(kind="random", amplitude_V=3.0, seed=3))
        samples.append(bench.read(64).samples)
    for name in samples[0]:
        scale = abs(samples[0][name]).max()
        np.testing.assert_allclose(samples[0][name], samples[1][name], atol=2e-6 * scale)


@pytest.mark.parametrize(
    "drive",
    [
        {"half_force_stroke": 1e-4},
        {"half_force_stroke": 1e-4, "amplifier": "current"},
        {"voltage_limit": 1.5},
        {"current_limit": 1.0, "amplifier": "current", "voltage_limit": 6.0},
    ],
    ids=["force factor", "current amplifier", "voltage limit", "current limit"],
)
def test_marching_meets_harmonic_balance_with_the_shaker(drive):
    """Force and tip, first and third harmonic, near the resonance, where the shaker matters most."""
    frequency = 26.0
    bench = open_bench(rig(**drive), sample_rate_Hz=RATE, setup=BenchSetup(noise=False, converter=False))
    bench.set_output(Excitation(kind="sine", amplitude_V=2.0, frequency_Hz=frequency))
    bench.read(25 * RATE)
    samples = bench.read(RATE).samples
    exact = HarmonicBalance(bench.built, harmonics=31, samples=1024).solve(frequency, 2.0)
    for n, channel in enumerate(bench.channels):
        values = samples[channel.name].astype(float)
        assert harmonic(values, frequency, 1) == pytest.approx(abs(exact.channels[n, 1]), rel=3e-4)
        assert harmonic(values, frequency, 3) == pytest.approx(abs(exact.channels[n, 3]), rel=0.01)


def test_the_stingers_side_of_the_force_cell_loads_the_stinger_and_is_not_measured():
    """Acceleration over measured force stays the structure's own; force per volt does not."""
    heavy_cell = [s.model_copy(update={"stinger_side_mass": 0.03}) if s.quantity == "force" else s for s in RIG.sensor]
    heavy = RIG.model_copy(update={"sensor": heavy_cell})
    frequency = np.array([20.0, 26.4, 157.0, 300.0])
    found = []
    for one in (RIG, heavy):
        bench = open_bench(one, joint_law=no_law())
        at = channels(bench)
        found.append(bench.built.rig(0.0, 51200.0).transfer(frequency)[:, [at["force"], at["acc2"]], 0])
    light, loaded = found
    np.testing.assert_allclose(loaded[:, 1] / loaded[:, 0], light[:, 1] / light[:, 0], rtol=2e-3)
    assert abs(loaded[3, 0] / light[3, 0] - 1) > 0.01


def test_a_laterally_stiff_stinger_raises_the_modes_by_its_energy():
    """d omega^2 = k (u + t/2 v')^2 at the drive point, to first order, for the mass-normalised mode."""
    structure, moduli = assemble(RIG), RIG.joint.preload["120N"]
    K = structure.stiffness(moduli.normal_modulus, moduli.shear_modulus)
    modes = normal_modes(structure.M, K, 3)
    surface = axial(structure, 0.05) + RIG.lower.thickness / 2 * slope(structure, 0.05)
    k = 1e4
    held = assemble(rig(stinger_lateral_stiffness=k))
    stiffer = normal_modes(held.M, held.stiffness(moduli.normal_modulus, moduli.shear_modulus), 3)
    np.testing.assert_allclose(stiffer.omega**2 - modes.omega**2, k * (surface @ modes.Phi) ** 2, rtol=0.02)
