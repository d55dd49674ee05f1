"""Continuation through the folds of a Duffing oscillator, against its closed one-harmonic response."""

from __future__ import annotations

import numpy as np
import pytest
from harmonic_balance_numpy import BALANCES

from twin.bench import BenchSetup, no_law, open_bench
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")


def balance(harmonics=1, which="compiled", **options):
    hard = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 2e7})
    bench = open_bench(RIG, joint_law=no_law(), effects=[hard], setup=BenchSetup(drive="force"))
    return BALANCES[which](bench.built, harmonics=harmonics, **options)


@pytest.fixture(scope="module")
def branch():
    return balance().branch(26.2, 29.0, 3.0)


def test_the_branch_turns_twice(branch):
    frequency = np.array([point.frequency_Hz for point in branch])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(frequency))))
    assert len(turns) == 2
    assert frequency[turns[0] + 1] > frequency[turns[1] + 1] + 0.2


def test_every_point_lies_on_the_exact_amplitude_equation(branch):
    """|V - alpha_vf F + alpha_vv (3/4) k V^2 V| = 0 on the tip, with receptances of the linear rig."""
    bench = open_bench(RIG, joint_law=no_law(), setup=BenchSetup(drive="force"))
    rig = bench.built.rig(0.0, 51200.0)
    built = bench.built
    tip = [c.name for c in bench.channels].index("acc2") + built.locals + built.auxiliaries
    at_tip = [s.model_copy(update={"position": 0.42}) if s.channel == "force" else s for s in RIG.sensor]
    moved = RIG.model_copy(update={"sensor": at_tip})
    loaded = open_bench(moved, joint_law=no_law(), setup=BenchSetup(drive="force")).built.rig(0.0, 51200.0)
    for point in branch[:: len(branch) // 12]:
        w = 2 * np.pi * point.frequency_Hz
        v = -point.channels[2, 1] / w**2
        alpha_f = -rig.transfer(np.array([point.frequency_Hz]))[0, tip, 0] / w**2
        alpha_v = -loaded.transfer(np.array([point.frequency_Hz]))[0, tip, 0] / w**2
        expected = alpha_f * (-3j) - alpha_v * 0.75 * 2e7 * abs(v) ** 2 * v
        assert abs(v - expected) < 2e-3 * abs(v)


def test_plain_twin_gives_the_same_state():
    compiled, plain = (balance(5, which, samples=128).solve(26.5, 1.0) for which in ("compiled", "plain"))
    np.testing.assert_allclose(compiled.channels, plain.channels, rtol=1e-10, atol=1e-12)


def test_a_branch_that_ends_early_gives_its_points_and_the_reason():
    whole, cut = balance().branch(26.2, 29.0, 3.0), balance().branch(26.2, 29.0, 3.0, most=3)
    assert whole.failure is None
    assert cut.failure is not None
    assert "more than 3 points" in str(cut.failure)
    assert [p.frequency_Hz for p in cut] == [p.frequency_Hz for p in whole[:4]]
    assert cut.failure.frequency_Hz == cut[-1].frequency_Hz
