"""The bench's stepped-sine steady state against harmonic balance, law by law; free decay; the size of the step."""

from __future__ import annotations

import numpy as np
import pytest
from smooth_backbones import masing

from recordings.streams import Excitation
from twin.bench import BenchSetup, JointLaw, no_law, open_bench
from twin.bench.layer import law_from_table
from twin.joint import Linear, Polynomial, iwan
from twin.response import HarmonicBalance
from twin.rigs import Effect, LayerLawTable, load_rig

RIG = load_rig("steel-lap-joint")
RATE = 2048
E = RIG.joint.preload["120N"].normal_modulus
O, Q = np.geomspace(1e-8, 2e-5, 40), np.geomspace(1e-8, 1e-5, 40)
TABLE = LayerLawTable(
    opening_m=list(O), softening=list(0.7 * E * O / (O + 2e-6)), slip_m=list(Q), loss=list(2e9 * Q**2 / (Q**2 + 4e-12))
)
CASES = {
    "default": {},
    "table": {"joint_law": law_from_table(TABLE, E=E)},
    "polynomial": {"joint_law": JointLaw(Polynomial((0.0, -2e13, 4e18), (0.0, 4e12), stick=2e-7))},
    "jenkins": {
        "effects": [
            Effect(
                cause="joint-friction",
                parameters={"layer_element": 1, "stiffness_N_per_m": 1e8, "slip_force_N": 40.0},
            )
        ]
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
MODES = {1: (26.5, 30.0, RATE, 11264.0), 2: (156.0, 8.0, RATE, 90112.0), 3: (470.0, 4.0, 5 * RATE, 245760.0)}
"""Frequency, wait (s), samples and steps a second: errors go with the square of the third harmonic's phase a step."""
HARMONICS = {"polynomial": (60, 2048)}
"""And samples, where 15 and 1024 are not enough: a force that jumps at reversals has slowly falling harmonics."""


def harmonics(signal, frequency_Hz, rate, count=25):
    t, count = np.arange(len(signal)) / rate, min(count, int(0.45 * rate / frequency_Hz))
    orders = np.arange(-count, count + 1)
    basis = np.exp(2j * np.pi * frequency_Hz * t[:, None] * orders)
    return 2 * np.linalg.lstsq(basis, signal.astype(float), rcond=None)[0][count:]


def steady(bench, frequency_Hz, amplitude, wait_s, rate=RATE):
    bench.set_output(Excitation(kind="sine", amplitude_V=amplitude, frequency_Hz=frequency_Hz))
    bench.read(int(wait_s * rate))
    samples = bench.read(rate).samples
    return {channel: harmonics(values, frequency_Hz, rate) for channel, values in samples.items()}


def compare(name, level, mode=1, *, waits=1.0):
    """Relative errors of the fundamental's and the third harmonic's size."""
    frequency_Hz, wait_s, rate, internal_rate_Hz = MODES[mode]
    setup = BenchSetup(drive="force", noise=False, converter=False, internal_rate_Hz=internal_rate_Hz)
    bench = open_bench(RIG, sample_rate_Hz=rate, setup=setup, **CASES[name])
    orders, samples = HARMONICS.get(name, (15, 1024))
    balance = HarmonicBalance(bench.built, harmonics=orders, samples=samples, internal_rate_Hz=internal_rate_Hz)
    at = [c.name for c in bench.channels].index("acc2")
    marched = steady(bench, frequency_Hz, level, waits * wait_s, rate)
    sweep = balance.sweep(np.linspace(1.04 * frequency_Hz, frequency_Hz, 12), level)
    expected = sweep[-1].channels[at]
    measured = marched["acc2"] / marched["force"][1] * level
    return abs(measured[1]) / abs(expected[1]) - 1, abs(measured[3]) / abs(expected[3]) - 1


@pytest.mark.parametrize("name", CASES)
def test_marching_meets_harmonic_balance(name):
    first, third = compare(name, 3.0)
    assert abs(first) < 1e-4
    assert abs(third) < 2e-3


@pytest.mark.parametrize("mode", [2, 3])
@pytest.mark.parametrize("name", ["default", "table", "slap"])
def test_marching_meets_harmonic_balance_about_other_modes(name, mode):
    """The points move each by itself; at mode 2 the third harmonic meets mode 3, and is a fifth of the fundamental."""
    first, third = compare(name, 3.0, mode)
    assert abs(first) < 1e-4
    assert abs(third) < 2e-3


@pytest.mark.slow
@pytest.mark.parametrize("level", [0.75, 1.5, 3.0, 6.0])
@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("name", CASES)
def test_marching_meets_harmonic_balance_at_every_level(name, mode, level):
    first, third = compare(name, level, mode, waits=1.5)
    assert abs(first) < 1e-4
    assert abs(third) < 2e-3


def ring_down(**options):
    """(frequency, damping ratio) of the tip after a burst in mode 1, from the decay's complex logarithm."""
    bench = open_bench(
        RIG, sample_rate_Hz=RATE, **options, setup=BenchSetup(drive="force", noise=False, converter=False)
    )
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
    bench = open_bench(RIG, joint_law=no_law(), setup=BenchSetup(drive="force"))
    assert frequency == pytest.approx(bench.built.modal(0.0, 11264.0).omega[0] / (2 * np.pi), rel=1e-5)
    assert ratio == pytest.approx(RIG.damping.modal_ratio[0], rel=1e-3)


def test_a_joint_spring_adds_no_damping():
    """A spring that takes half of E' is marched as a joint force; the closed loop's exact pole has the same damping."""
    soft = JointLaw(Linear(-0.5 * E))
    frequency, ratio = ring_down(joint_law=soft)
    built = open_bench(RIG, joint_law=soft, setup=BenchSetup(drive="force")).built
    rig = built.rig(0.0, 11264.0)
    k, n = np.diag([-0.5 * E * element.scale for element in built.elements_]), built.locals
    closed = rig.A + rig.B[:, 1:] @ np.linalg.solve(np.eye(n) - k @ rig.D[:n, 1:], k @ rig.C[:n])
    pole = min(np.linalg.eigvals(closed), key=lambda p: abs(p - 2j * np.pi * frequency))
    assert frequency == pytest.approx(pole.imag / (2 * np.pi), rel=1e-5)
    assert ratio == pytest.approx(-pole.real / abs(pole), rel=1e-3)
    assert frequency < 26.4


def test_halving_the_step_changes_nothing_visible():
    values = []
    for rate in (11264.0, 22528.0):
        bench = open_bench(
            RIG, sample_rate_Hz=RATE, setup=BenchSetup(noise=False, converter=False, internal_rate_Hz=rate)
        )
        values.append(steady(bench, 26.3, 0.9, 8.0))
    for channel in ("acc1", "acc2"):
        a, b = (v[channel] / v["force"][1] for v in values)
        assert abs(a[1] - b[1]) < 1e-4 * abs(b[1])
        assert abs(abs(a[3]) - abs(b[3])) < 3e-3 * abs(b[3])


def test_the_default_law_is_the_papers_in_kind():
    """Receptance peaks at 120 N and 1.5, 3, 6 N of 1.2, 0.9, 0.65e-3 m/N; the resonance drops by 0.1 to 0.25 Hz."""
    bench = open_bench(RIG, setup=BenchSetup(drive="force"))
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
