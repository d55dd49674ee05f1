"""Floquet multipliers of a linear rig are its poles' exponentials, and a branch is unstable between its folds."""

from __future__ import annotations

import numpy as np
import pytest

from twin.bench import BenchSetup, JointLaw, no_law, open_bench
from twin.joint import jenkins
from twin.response import HarmonicBalance
from twin.rigs import Effect, load_rig

RIG = load_rig("steel-lap-joint")


def test_multipliers_of_a_linear_rig_are_the_exponentials_of_its_poles():
    built = open_bench(RIG, joint_law=no_law(), setup=BenchSetup(drive="force")).built
    balance = HarmonicBalance(built, harmonics=3)
    found = balance.multipliers(balance.solve(26.0, 1.0))
    pole = built.poles(0.0, 51200.0).pole
    expected = np.exp(np.concatenate([pole, pole.conj()]) / 26.0)
    order = np.argsort(-np.abs(expected))
    np.testing.assert_allclose(np.abs(found[:6]), np.abs(expected[order][:6]), rtol=1e-8)
    np.testing.assert_allclose(np.sort_complex(found[:4]), np.sort_complex(expected[order][:4]), rtol=1e-8)


@pytest.mark.parametrize("law", [{}, {"joint_law": JointLaw(jenkins(1e8, 60.0))}], ids=["running loss", "slider"])
def test_a_branch_is_unstable_between_its_folds_and_nowhere_else(law):
    hard = Effect(cause="cubic-stiffness", parameters={"position_m": 0.42, "stiffness_N_per_m3": 3e7})
    balance = HarmonicBalance(open_bench(RIG, effects=[hard], **law, setup=BenchSetup(drive="force")).built)
    points = balance.branch(26.0, 27.5, 3.0, step=0.1)
    frequency = np.array([point.frequency_Hz for point in points])
    turns = 1 + np.flatnonzero(np.diff(np.sign(np.diff(frequency))))
    assert len(turns) == 2
    stable = np.array([balance.stable(point) for point in points])
    changes = np.flatnonzero(np.diff(stable.astype(int)))
    assert len(changes) == 2
    assert np.all(np.abs(changes - turns) <= 2)  # points, where the branch hardly moves in frequency
    np.testing.assert_allclose(frequency[changes], frequency[turns], atol=0.005)
    assert stable[0]
    assert not stable[(turns[0] + turns[1]) // 2]
