"""The law as splines of opening and slip: what they reproduce exactly, and how well they follow one that saturates."""

import numpy as np
import pytest

from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots, curve_precision, packed_laws, spline_basis
from twin.joint import Saturating

KNOTS = np.geomspace(5e-8, 8e-6, 20)
FINER = np.geomspace(1e-8, 2e-6, 12)


def test_values_at_the_knots_are_the_knots_and_at_rest_there_is_nothing():
    """Softening and loss have knots of their own."""
    rng = np.random.default_rng(1)
    law = LayerLaw(KNOTS, FINER, rng.standard_normal(20), rng.standard_normal(12))
    np.testing.assert_allclose(law.softening_at(KNOTS), law.softening, atol=1e-13)
    np.testing.assert_allclose(law.loss_at(FINER), law.loss, atol=1e-13)
    np.testing.assert_allclose([law.softening_at(0.0), law.loss_at(0.0)], 0.0, atol=1e-13)
    assert np.all(LayerLaw.zero(KNOTS, FINER).softening_at(KNOTS) == 0)


def test_one_vector_has_both_parts():
    law = LayerLaw(KNOTS, FINER, np.arange(20.0), np.arange(12.0))
    np.testing.assert_array_equal(law.vector[:20], law.softening)
    np.testing.assert_array_equal(law.vector[20:], law.loss)


def test_beyond_the_last_knot_the_law_levels_off_without_a_corner():
    """A fit is drawn to a corner; far beyond, where nothing is known, the law is constant."""
    law, last = LayerLaw(KNOTS, FINER, KNOTS * 1e12, -FINER), KNOTS[-1]
    slope = np.diff(law.softening_at(last * np.array([1 - 1e-5, 1.0, 1 + 1e-5])))
    assert slope[1] == pytest.approx(slope[0], rel=1e-4)
    values = law.softening_at(last * np.array([1.0, 1.3, 2.0, 2.8, 1e6]))
    assert np.all(np.diff(values)[:3] > 0)
    assert values[-1] == pytest.approx(values[-2], rel=1e-9)
    assert not spline_basis(KNOTS, np.array([3 * last]))[1].any()


def test_a_straight_line_over_the_logarithm_is_followed_exactly():
    """What a natural cubic spline has no curvature for, in the variable that it is a spline of."""
    law = LayerLaw(KNOTS, FINER, 3.0 * np.log(1 + 2 * KNOTS / KNOTS[0]), np.log(1 + 2 * FINER / FINER[0]))
    x = np.geomspace(1e-10, 2e-6, 200)
    np.testing.assert_allclose(law.softening_at(x), 3.0 * np.log(1 + 2 * x / KNOTS[0]), rtol=1e-9)
    np.testing.assert_allclose(law.loss_at(x), np.log(1 + 2 * x / FINER[0]), rtol=1e-9)


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
    x, offset = np.linspace(0, KNOTS[-1], 300), KNOTS[0] / 2
    expected = natural_spline(np.log(np.append(0, KNOTS) + offset), np.append(0, y), np.log(x + offset))
    np.testing.assert_allclose(LayerLaw.zero(KNOTS, FINER).softening_basis(x) @ y, expected, atol=1e-11)


def test_slopes_are_derivatives_by_the_logarithm_of_amplitude():
    x, step = np.geomspace(1e-9, 5e-5, 100), 1e-5
    expected = (spline_basis(KNOTS, x * np.exp(step))[0] - spline_basis(KNOTS, x * np.exp(-step))[0]) / (2 * step)
    np.testing.assert_allclose(spline_basis(KNOTS, x)[1], expected, atol=1e-8)


def test_cubics_for_compiled_code_are_the_same_spline():
    """Read as compiled code reads them: by the interval that an amplitude's logarithm falls into."""
    y = np.random.default_rng(3).standard_normal(20)
    (c,), _ = packed_laws((LayerLaw(KNOTS, FINER, y, np.zeros(12)),), np.zeros(1, int))
    x = np.geomspace(1e-9, 2e-4, 300)
    u = np.log(x + c[5, 0])
    i = np.clip(np.searchsorted(c[4], u) - 1, 0, c.shape[1] - 2)
    t = u - c[4, i]
    np.testing.assert_allclose(
        np.polynomial.polynomial.polyval(t, c[3::-1, i], tensor=False), spline_basis(KNOTS, x)[0] @ y, atol=1e-12
    )


def test_a_saturating_law_is_followed_to_parts_in_a_thousand():
    law = Saturating(0.85, 1e-6, -0.85)
    found = LayerLaw(KNOTS, FINER, -law.describing_function(KNOTS).real, np.zeros(12))
    x = np.linspace(1e-9, 8e-6, 500)
    assert np.max(np.abs(found.softening_at(x) + law.describing_function(x).real)) < 3e-3 * 0.85


@pytest.mark.parametrize("largest", [3e-9, 7e-6])
def test_knots_are_spread_over_the_amplitudes_that_matter(largest):
    """From a hundredth of the largest one to a little beyond it, however many steps and points there are."""
    knots = choose_knots(largest * np.random.default_rng(3).uniform(0, 1, (400, 3)).clip(None, 1), 20)
    assert len(knots) == 20
    np.testing.assert_allclose(np.diff(np.log(knots)), np.log(knots[1] / knots[0]))
    assert knots[0] == pytest.approx(0.01 * largest, rel=0.02)
    assert largest < knots[-1] < 1.2 * largest


def test_without_steps_there_are_knots_too():
    for nothing in (np.zeros(0), np.zeros((0, 3)), np.zeros((7, 3))):
        knots = choose_knots(nothing, 20)
        assert np.all(np.diff(knots) > 0)
        assert np.all(np.isfinite(LayerLaw.zero(knots, knots).softening_basis(knots)))


def test_the_prior_of_a_curve_is_one_random_function_however_many_knots_show_it():
    """Standard deviations of its values where the amplitude is half of, and nearly, the largest."""
    spread = []
    for count in (30, 60, 120):
        knots = choose_knots(np.array([1e-6]), count)
        covariance = np.linalg.inv(curve_precision(knots, 3.0))
        at = np.array([np.interp(np.log(x * knots[-1]), np.log(knots), np.arange(count)) for x in (0.5, 0.95)])
        spread.append(np.sqrt(np.diag(covariance))[np.rint(at).astype(int)])
    np.testing.assert_allclose(spread[0], spread[2], rtol=0.15)
    np.testing.assert_allclose(spread[1], spread[2], rtol=0.08)
