"""Phase resonance on the steel rig against the backbone that harmonic balance finds without marching or control."""

import numpy as np
import pytest
from resonator import ListSink
from scipy.optimize import brentq

from twin.bench import BenchSetup, open_bench
from twin.procedures import DirectAcquisition, SteppedSine, run_procedure
from twin.procedures.tables import Phase, Settle
from twin.response import HarmonicBalance
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")
RATE_Hz = 16384.0  # of the physics: marching and harmonic balance are to have the same modes


def phase_degrees(solution, names):
    """Of acc2 ahead of the force."""
    acc2, force = (solution.channels[names.index(name)][1] for name in ("acc2", "force"))
    return np.degrees(np.angle(acc2 / force))


def backbone_frequency(balance, names, force_N):
    """Where acc2 leads a force of one harmonic by a quarter turn; approached along the branch from above."""
    points = balance.branch(27.5, 25.5, force_N, step=0.02)
    after = next(i for i, point in enumerate(points) if phase_degrees(point, names) > 90)
    high, low = points[after - 1], points[after]

    def off(frequency_Hz):
        return phase_degrees(balance.solve(frequency_Hz, force_N, start=low), names) - 90

    return brentq(off, low.frequency_Hz, high.frequency_Hz, xtol=1e-6)


@pytest.mark.parametrize(
    "levels", [[0.2, 1.0], pytest.param([0.2, 0.5, 1.0, 2.0, 3.0, 4.5, 6.0], marks=pytest.mark.slow)]
)
def test_phase_resonance_follows_the_backbone_of_harmonic_balance(levels):
    procedure = SteppedSine(
        frequencies=[26.4], amplitudes=levels, control="phase-resonance", phase=Phase(channel="acc2")
    )
    bench = open_bench(RIG, seed=4, sample_rate_Hz=procedure.sample_rate, setup=BenchSetup(internal_rate_Hz=RATE_Hz))
    result = run_procedure(procedure, DirectAcquisition(bench), ListSink())
    free = open_bench(
        RIG, sample_rate_Hz=procedure.sample_rate,
        setup=BenchSetup(drive="force", noise=False, converter=False, internal_rate_Hz=RATE_Hz),
    )  # fmt: skip
    names = [channel.name for channel in free.channels]
    balance = HarmonicBalance(free.built, harmonics=7, internal_rate_Hz=RATE_Hz)
    assert [step.target_amplitude for step in result.steps] == levels
    for step in result.steps:
        assert step.frequency_Hz == pytest.approx(backbone_frequency(balance, names, step.target_amplitude), abs=0.01)
        assert abs(step.amplitude_error) < 0.005


@pytest.mark.parametrize("force_N", [1.5, pytest.param(6.0, marks=pytest.mark.slow)])
def test_a_stepped_sine_gives_the_responses_of_harmonic_balance(force_N):
    settle = Settle(tolerance=1e-4)  # near a fold the decay is slow, and its end known to a few times this
    procedure = SteppedSine(frequencies=[26.2, 26.4, 26.6], amplitudes=[force_N], settle=settle)
    bench = open_bench(RIG, seed=4, sample_rate_Hz=procedure.sample_rate, setup=BenchSetup(internal_rate_Hz=RATE_Hz))
    result = run_procedure(procedure, DirectAcquisition(bench), ListSink())
    free = open_bench(
        RIG, sample_rate_Hz=procedure.sample_rate,
        setup=BenchSetup(drive="force", noise=False, converter=False, internal_rate_Hz=RATE_Hz),
    )  # fmt: skip
    names = [channel.name for channel in free.channels]
    balance = HarmonicBalance(free.built, harmonics=7, internal_rate_Hz=RATE_Hz)
    path = balance.branch(25.5, 27.5, force_N, step=0.02)
    for step in result.steps:
        near = min(path, key=lambda point, f=step.frequency_Hz: abs(point.frequency_Hz - f))
        exact = balance.solve(step.frequency_Hz, step.amplitude, start=near)
        expected = exact.channels[names.index("acc2")][1] / exact.channels[names.index("force")][1]
        found = step.phasors["acc2"] / step.phasors["force"]
        assert found == pytest.approx(expected, rel=1e-3)
