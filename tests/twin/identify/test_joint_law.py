"""The law as splines of amplitude: what they reproduce exactly, and how well they follow a law that saturates."""

import numpy as np
import pytest

from twin.identify.joint_law import SplineLaw, choose_knots
from twin.joint import Saturating

KNOTS = np.linspace(np.sqrt(5e-5), np.sqrt(3e-3), 20) ** 2


def test_values_at_the_knots_are_the_knots_and_at_rest_there_is_nothing():
    rng = np.random.default_rng(1)
    law = SplineLaw(KNOTS, rng.standard_normal(20), rng.standard_normal(20))
    np.testing.assert_allclose(law.softening_at(KNOTS), law.softening, atol=1e-13)
    np.testing.assert_allclose(law.loss_at(KNOTS), law.loss, atol=1e-13)
    assert law.softening_at(0.0) == pytest.approx(0.0, abs=1e-13)
    assert np.all(SplineLaw.zero(KNOTS).softening_at(KNOTS) == 0)


def test_beyond_the_last_knot_the_law_stays_as_it_is():
    law = SplineLaw(KNOTS, KNOTS * 1e12, -KNOTS)
    np.testing.assert_allclose(law.softening_at([3e-3, 4e-3, 1.0]), 3e9, rtol=1e-12)
    np.testing.assert_allclose(law.loss_at([3e-3, 1.0]), -3e-3, rtol=1e-12)


def test_a_straight_line_over_the_logarithm_is_followed_exactly():
    """What a natural cubic spline has no curvature for, in the variable that it is a spline of."""
    u = np.log(1 + 2 * KNOTS / KNOTS[0])
    law = SplineLaw(KNOTS, 3.0 * u, u)
    X = np.geomspace(1e-6, 3e-3, 200)
    np.testing.assert_allclose(law.softening_at(X), 3.0 * np.log(1 + 2 * X / KNOTS[0]), rtol=1e-10)


def natural_spline(u, y, at):
    """By the tridiagonal equations for the second derivatives at the knots, which vanish at both ends."""
    h, rise = np.diff(u), np.diff(y) / np.diff(u)
    system = np.diag(2 * (h[:-1] + h[1:])) + np.diag(h[1:-1], 1) + np.diag(h[1:-1], -1)
    M = np.concatenate([[0.0], np.linalg.solve(system, 6 * np.diff(rise)), [0.0]])
    i = np.clip(np.searchsorted(u, at) - 1, 0, len(u) - 2)
    a, b, w = u[i + 1] - at, at - u[i], h[i]
    curved = (M[i] * a**3 + M[i + 1] * b**3) / (6 * w)
    return curved + (y[i] / w - M[i] * w / 6) * a + (y[i + 1] / w - M[i + 1] * w / 6) * b


def test_between_the_knots_it_is_the_natural_cubic_spline_over_the_logarithm():
    y = np.random.default_rng(2).standard_normal(20)
    X, offset = np.linspace(0, KNOTS[-1], 300), KNOTS[0] / 2
    expected = natural_spline(np.log(np.append(0, KNOTS) + offset), np.append(0, y), np.log(X + offset))
    np.testing.assert_allclose(SplineLaw(KNOTS, y, np.zeros(20)).softening_at(X), expected, atol=1e-11)


def test_a_saturating_law_is_followed_to_parts_in_a_thousand():
    law = Saturating(0.85, 6e-4, -0.85)
    found = SplineLaw(KNOTS, -law.stiffness(KNOTS).real, np.zeros(20))
    X = np.linspace(5e-5, 3e-3, 500)
    assert np.max(np.abs(found.softening_at(X) + law.stiffness(X).real)) < 1e-3 * 0.85


@pytest.mark.parametrize("count", [1, 2, 3, 5, 40, 400])
def test_knots_span_the_measured_amplitudes_and_are_fewer_than_they(count):
    amplitudes = np.random.default_rng(3).uniform(1e-4, 2e-3, count)
    knots = choose_knots(amplitudes, 20)
    assert 2 <= len(knots) <= 20
    assert len(knots) <= max(2, count // 2)
    assert np.all(np.diff(knots) > 0)
    if count > 1:
        np.testing.assert_allclose([knots[0], knots[-1]], [amplitudes.min(), amplitudes.max()], rtol=1e-12)
    assert np.all(np.isfinite(SplineLaw.zero(knots).basis(amplitudes)))


def test_without_steps_there_are_knots_too():
    assert np.all(np.diff(choose_knots(np.zeros(0), 20)) > 0)
    equal = choose_knots(np.full(7, 1e-3), 20)
    assert equal[0] < 1e-3 < equal[1]
