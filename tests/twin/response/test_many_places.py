"""Harmonic balance with more unknowns than are eliminated by hand, beside one written in numpy."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.balance_by_hand import BalanceByHand
from benchmarks.rig_of_places import rig_of_sliders
from twin.response import HarmonicBalance
from twin.response.solve import BY_HAND, solve

HARMONICS, SAMPLES, FORCE_N = 3, 128, 3.0
FREQUENCIES_Hz = np.linspace(29.0, 33.0, 5)


@pytest.mark.parametrize("n", [BY_HAND - 1, BY_HAND, BY_HAND + 1, 150])
def test_solutions_solve_on_both_sides_of_the_threshold(n):
    rng = np.random.default_rng(n)
    A, right = rng.standard_normal((n, n)), rng.standard_normal((n, 2))
    found = right.copy()
    solve(A.copy(), found)
    np.testing.assert_allclose(A @ found, right, atol=1e-9)


@pytest.mark.parametrize("n", [4, BY_HAND + 10])
def test_a_singular_system_has_no_finite_solution_and_raises_nothing(n):
    found = np.ones((n, 1))
    solve(np.zeros((n, n)), found)
    assert not np.isfinite(found).all()


@pytest.mark.parametrize("places", [2, 12])
def test_steady_states_are_those_of_numpy(places):
    rig = rig_of_sliders(places)
    balance = HarmonicBalance(rig.built, harmonics=HARMONICS, samples=SAMPLES)
    assert (balance.solve(30.0, FORCE_N).unknowns.size > BY_HAND) is (places == 12)
    found = [state.channels[0, 1] for state in balance.sweep(list(FREQUENCIES_Hz), FORCE_N)]
    expected = BalanceByHand(rig, HARMONICS, SAMPLES).sweep(FREQUENCIES_Hz, FORCE_N)
    np.testing.assert_allclose(found, expected, rtol=1e-7)


def test_a_branch_through_the_resonance_ends_where_it_should():
    balance = HarmonicBalance(rig_of_sliders(12).built, harmonics=HARMONICS, samples=SAMPLES)
    branch = balance.branch(29.0, 33.0, FORCE_N)
    assert branch.failure is None
    near = min(branch, key=lambda state: abs(state.frequency_Hz - 31.0))
    exact = balance.solve(near.frequency_Hz, FORCE_N)
    np.testing.assert_allclose(near.channels[0, 1], exact.channels[0, 1], rtol=1e-6)
