"""The bench's stepped-sine steady state against harmonic balance, law by law; free decay; the size of the step."""

from __future__ import annotations

import numpy as np
import pytest

from recordings.streams import Excitation
from twin.bench import JointLaw, no_law, open_bench
from twin.joint import Linear, Polynomial, iwan, masing
from twin.response import HarmonicBalance
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")
RATE = 2048
E = RIG.joint.preload["120N"].normal_modulus
CASES = {
    "default": {},
    "element": {"acting": "element"},
    "polynomial": {"joint_law": JointLaw(Polynomial((0.0, -2e13, 4e18), (0.0, 4e12), stick=2e-7))},
    "jenkins": {
        "effects": [Effect(cause="joint-friction", parameters={"stiffness_N_per_m": 1e8, "slip_force_N": 40.0})]
    },
    "iwan": {"joint_law": JointLaw(iwan(0.3 * E, 0.3 * E * 1e-6, chi=-0.5))},
    "masing": {"joint_law": JointLaw(masing(lambda e: 0.3 * E * 1e-6 * np.tanh(e / 1e-6), limit_m=4e-6))},
    "slap": {"effects": [Effect(cause="joint-slap", parameters={"gap_m": 5e-7, "stiffness_factor": 0.5})]},
    "cubic": {"effects": [Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 8e6})]},
    "stop": {
        "effects": [
            Effect(cause="ground-stop", parameters={"position_m": 0.4, "gap_m": 8e-4, "stiffness_N_per_m": 60.0})
        ]
    },
    "friction": {"effects": [Effect(cause="ground-friction", parameters={"position_m": 0.4, "force_N": 0.01})]},
}
HARMONICS = {"polynomial": (60, 2048)}
"""And samples, where 15 and 1024 are not enough: a force that jumps at reversals has slowly falling harmonics."""


def harmonics(signal, frequency_Hz, count=25):
    t = np.arange(len(signal)) / RATE
    orders = np.arange(-count, count + 1)
    basis = np.exp(2j * np.pi * frequency_Hz * t[:, None] * orders)
    return 2 * np.linalg.lstsq(basis, signal.astype(float), rcond=None)[0][count:]


def steady(bench, frequency_Hz, amplitude, wait_s):
    bench.set_output(Excitation(kind="sine", amplitude_V=amplitude, frequency_Hz=frequency_Hz))
    bench.read(int(wait_s * RATE))
    samples = bench.read(RATE).samples
    return {channel: harmonics(values, frequency_Hz) for channel, values in samples.items()}


def compare(name, level, *, wait_s, frequency_Hz=26.5, internal_rate_Hz=11264.0):
    options = {"drive": "force", "noise": False, "converter": False, "internal_rate_Hz": internal_rate_Hz} | CASES[name]
    bench = open_bench(RIG, sample_rate_Hz=RATE, **options)
    orders, samples = HARMONICS.get(name, (15, 1024))
    balance = HarmonicBalance(bench.built, harmonics=orders, samples=samples)
    at = [c.name for c in bench.channels].index("acc2")
    marched = steady(bench, frequency_Hz, level, wait_s)
    sweep = balance.sweep(np.linspace(frequency_Hz + 1.0, frequency_Hz, 12), level)
    expected = sweep[-1].channels[at]
    measured = marched["acc2"] / marched["force"][1] * level
    return abs(measured[1]) / abs(expected[1]) - 1, abs(measured[3]) / abs(expected[3]) - 1


@pytest.mark.parametrize("name", CASES)
def test_marching_meets_harmonic_balance(name):
    first, third = compare(name, 3.0, wait_s=30.0)
    assert abs(first) < 1e-4
    assert abs(third) < 0.01


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.75, 1.5, 6.0])
@pytest.mark.parametrize("name", CASES)
def test_marching_meets_harmonic_balance_at_every_level(name, level):
    first, third = compare(name, level, wait_s=45.0)
    assert abs(first) < 1e-4
    assert abs(third) < 0.01


def ring_down(**options):
    """(frequency, damping ratio) of the tip after a burst in mode 1, from the decay's complex logarithm."""
    bench = open_bench(RIG, sample_rate_Hz=RATE, drive="force", noise=False, converter=False, **options)
    bench.set_output(Excitation(kind="sine", amplitude_V=0.02, frequency_Hz=26.45))
    bench.read(RATE * 4)
    bench.set_output(Excitation())
    bench.read(RATE)
    tail = bench.read(RATE * 8).samples["acc2"].astype(float)
    size = len(tail) // 2
    # Demodulate over windows of whole cycles and fit a line to the logarithm.
    t = np.arange(len(tail)) / RATE
    window = np.hanning(2 * RATE)
    starts = np.arange(0, size, RATE // 8)
    slow = [np.sum(window * tail[s : s + 2 * RATE] * np.exp(-2j * np.pi * 26.45 * t[s : s + 2 * RATE])) for s in starts]
    log = np.log(slow)
    decay = np.polyfit(starts / RATE, log.real, 1)[0]
    shift = np.polyfit(starts / RATE, np.unwrap(log.imag), 1)[0]
    omega = 2 * np.pi * 26.45 + shift
    return omega / (2 * np.pi), -decay / np.hypot(decay, omega)


def test_free_decay_shows_the_intended_damping():
    frequency, ratio = ring_down(joint_law=no_law())
    bench = open_bench(RIG, drive="force", joint_law=no_law())
    assert frequency == pytest.approx(bench.built.modal(0.0, 11264.0).omega[0] / (2 * np.pi), rel=1e-5)
    assert ratio == pytest.approx(RIG.damping.modal_ratio[0], rel=1e-3)


def test_a_joint_spring_adds_no_damping():
    """A spring that takes half of E' is marched as a joint force; the closed loop's exact pole has the same damping."""
    soft = JointLaw(Linear(-0.5 * E))
    frequency, ratio = ring_down(joint_law=soft)
    built = open_bench(RIG, drive="force", joint_law=soft).built
    rig = built.rig(0.0, 11264.0)
    k = -0.5 * E * built.elements_[0].scale
    closed = rig.A + rig.B[:, 1:] @ (k / (1 - k * rig.D[0, 1]) * rig.C[:1])
    pole = min(np.linalg.eigvals(closed), key=lambda p: abs(p - 2j * np.pi * frequency))
    assert frequency == pytest.approx(pole.imag / (2 * np.pi), rel=1e-5)
    assert ratio == pytest.approx(-pole.real / abs(pole), rel=1e-3)
    assert frequency < 26.4


def test_halving_the_step_changes_nothing_visible():
    values = []
    for rate in (11264.0, 22528.0):
        bench = open_bench(RIG, sample_rate_Hz=RATE, noise=False, converter=False, internal_rate_Hz=rate)
        values.append(steady(bench, 26.3, 0.9, 8.0))
    for channel in ("acc1", "acc2"):
        a, b = (v[channel] / v["force"][1] for v in values)
        assert abs(a[1] - b[1]) < 1e-4 * abs(b[1])
        assert abs(abs(a[3]) - abs(b[3])) < 3e-3 * abs(b[3])


def test_the_default_law_is_the_papers_in_kind():
    """Receptance peaks at 120 N and 1.5, 3, 6 N of 1.2, 0.9, 0.65e-3 m/N; the resonance drops by 0.1 to 0.25 Hz."""
    bench = open_bench(RIG, drive="force")
    balance = HarmonicBalance(bench.built, harmonics=7)
    peaks = []
    for force in (1.5, 3.0, 6.0):
        branch = balance.branch(26.9, 25.9, force, step=0.1)
        receptance = [abs(p.channels[2, 1]) / (2 * np.pi * p.frequency_Hz) ** 2 / force for p in branch]
        best = int(np.argmax(receptance))
        peaks.append((branch[best].frequency_Hz, receptance[best]))
    frequency, receptance = np.array(peaks).T
    # The rig file's own modal damping would allow 1.13e-3 at most.
    np.testing.assert_allclose(receptance, [1.08e-3, 0.90e-3, 0.65e-3], rtol=0.04)
    assert 0.1 < frequency[0] - frequency[2] < 0.25
