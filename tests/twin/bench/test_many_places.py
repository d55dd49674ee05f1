"""Elements at many places: what is kept from one correction to the next gives the correction that a solver gives."""

from __future__ import annotations

import numpy as np
import pytest
from march_numpy import march_numpy

from benchmarks.rig_of_places import RigOfPlaces, rig_of_sliders
from twin.bench.many_places import CHANGED, correct
from twin.bench.marching import coefficients, integrate
from twin.joint import one_sided

RATE_Hz = 25600.0


def test_corrections_are_those_of_a_solver_whatever_changed_before():
    rng = np.random.default_rng(5)
    n = 12
    root = rng.standard_normal((n, n))
    flexibility = -0.02 * root @ root.T
    D = np.column_stack([rng.standard_normal(n), flexibility])
    tangent, kept, S = np.zeros(n), np.zeros(n), np.zeros((n, n))
    for turn in range(200):
        tangent[rng.integers(n, size=3)] = rng.choice([0.0, 1.0, 7.5], size=3)
        residual = rng.standard_normal(n)
        found = residual.copy()
        correct(D, tangent, kept, S, np.ones(n), found, turn % 20)
        expected = np.linalg.solve(np.eye(n) - flexibility * tangent, residual)
        assert np.linalg.norm(found - expected) < 1e-9 * np.linalg.norm(expected), turn


def test_a_little_change_is_left_and_costs_no_more_than_it_says():
    D = np.column_stack([np.zeros(2), -np.eye(2)])
    kept, S, found = np.zeros(2), np.zeros((2, 2)), np.ones(2)
    correct(D, np.array([0.0, 0.5 * CHANGED]), kept, S, np.ones(2), found, 0)
    assert kept.tolist() == [0.0, 0.0]
    np.testing.assert_allclose(found, 1.0, rtol=CHANGED)


def test_a_change_is_followed_where_another_coordinate_feels_it_in_its_own_size():
    """A joint's opening and its slip's speed: by the diagonal alone the change is small, yet the speed is all of it."""
    D = np.column_stack([np.zeros(2), [[-1e-8, 0.0], [1e-5, -1e-4]]])
    tangent, size = np.array([7e3, 0.0]), np.array([1e-8, 1e-9])
    kept, S, found = np.zeros(2), np.zeros((2, 2)), np.array([1e-9, 1e-10])
    expected = np.linalg.solve(np.eye(2) - D[:, 1:] * tangent, found)
    correct(D, tangent, kept, S, size, found, 0)
    np.testing.assert_allclose(found, expected, rtol=1e-9)


@pytest.mark.parametrize(
    "rig",
    [rig_of_sliders(3), rig_of_sliders(20), RigOfPlaces(12, 8, one_sided(2e5, 1e-5))],
    ids=["3 sliders", "20 sliders", "12 gaps"],
)
def test_the_march_is_that_of_numpy(rig):
    """numpy solves anew at each iteration."""
    c = coefficients(rig.poles(0.0, RATE_Hz), 1.0 / RATE_Hz)
    step = c.packed(rig.places, 0)
    drive = 3.0 * np.sin(2 * np.pi * 28.0 * np.arange(600) / RATE_Hz)
    found = []
    for march in (integrate, march_numpy):
        out = np.empty((len(drive), 1))
        start = np.zeros_like(step.decay), np.zeros(rig.places), np.zeros(1 + rig.places)
        assert march(step, rig.elements(), *start, drive, out) == 0
        found.append(out[:, 0])
    linear = np.empty((len(drive), 1))
    none = rig.elements()._replace(scale=np.zeros(rig.places))
    integrate(step, none, np.zeros_like(step.decay), np.zeros(rig.places), np.zeros(1 + rig.places), drive, linear)
    assert np.ptp(linear[:, 0] - found[1]) > 0.05 * np.ptp(found[1])
    np.testing.assert_allclose(found[0], found[1], atol=1e-8 * np.ptp(found[1]))
