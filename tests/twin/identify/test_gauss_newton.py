"""The minimiser against closed forms and against SciPy's trust-region solver, with priors, limits and failed steps."""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
import pytest
from scipy.optimize import least_squares, lsq_linear

from twin.identify.gauss_newton import StepRule, minimise, minimise_reweighted
from twin.identify.time_limit import time_limit

t = np.linspace(0.0, 4.0, 60)


def line(seed, count=4):
    """A correlated linear problem: columns, data, and a prior that matters."""
    rng = np.random.default_rng(seed)
    A = rng.standard_normal((40, count)) @ (np.eye(count) + rng.standard_normal((count, count)))
    y = A @ rng.standard_normal(count) + rng.standard_normal(40)
    root = rng.standard_normal((count, count))
    return A, y, rng.standard_normal(count), 5.0 * root @ root.T + np.eye(count)


def decay(x):
    """Offset plus a decaying oscillation, strongly nonlinear in rate and frequency; and its derivative."""
    offset, size, rate, omega = x
    e, c, s = np.exp(-rate * t), np.cos(omega * t), np.sin(omega * t)
    return offset + size * e * c, np.stack([np.ones_like(t), e * c, -size * t * e * c, -size * t * e * s], axis=1)


def reference(residual, start, mean, precision, bounds=(-np.inf, np.inf)):
    """Least cost of the same problem by SciPy, and where: the prior as further residuals."""
    root = np.linalg.cholesky(precision).T
    found = least_squares(
        lambda x: np.concatenate([residual(x), root @ (x - mean)]),
        start, bounds=bounds, method="trf", xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    return 2 * found.cost, found.x


def test_a_linear_problem_gives_the_posterior_of_the_textbook():
    A, y, mean, precision = line(1)
    found = minimise(lambda x: (y - A @ x, A), np.zeros(4), mean=mean, precision=precision, tolerance=1e-12)
    information = A.T @ A + precision
    best = np.linalg.solve(information, A.T @ y + precision @ mean)
    np.testing.assert_allclose(found.x, best, rtol=1e-7)
    np.testing.assert_allclose(found.covariance, np.linalg.inv(information), rtol=1e-9)
    assert found.chi2 == pytest.approx(np.sum((y - A @ best) ** 2))
    assert found.penalty == pytest.approx((best - mean) @ precision @ (best - mean))
    assert found.history[-1] == found.cost < found.history[0]


def test_a_nonlinear_problem_ends_where_trust_region_does():
    rng = np.random.default_rng(2)
    truth = np.array([0.3, 2.0, 0.4, 5.0])
    y = decay(truth)[0] + 0.05 * rng.standard_normal(len(t))
    mean, precision = np.array([0.0, 1.0, 0.5, 4.6]), np.diag([1.0, 0.5, 4.0, 0.25])

    def evaluate(x):
        model, J = decay(x)
        return (y - model) / 0.05, J / 0.05

    found = minimise(evaluate, mean, mean=mean, precision=precision, tolerance=1e-10)
    cost, best = reference(lambda x: evaluate(x)[0], mean, mean, precision)
    assert found.cost == pytest.approx(cost, rel=1e-9)
    np.testing.assert_allclose(found.x, best, rtol=1e-5)
    assert np.all(np.diff(found.history) < 0)
    assert np.all(np.abs(found.x - truth) < 4 * np.sqrt(np.diag(found.covariance)))


def test_the_stated_covariance_is_the_scatter_of_repeated_fits():
    rng = np.random.default_rng(3)
    truth = np.array([0.3, 2.0, 0.4, 5.0])
    clean, precision = decay(truth)[0], 1e-8 * np.eye(4)
    pulls = []
    for _ in range(200):
        y = clean + 0.1 * rng.standard_normal(len(t))
        found = minimise(
            lambda x, y=y: ((y - decay(x)[0]) / 0.1, decay(x)[1] / 0.1),
            truth, mean=truth, precision=precision, tolerance=1e-6,
        )  # fmt: skip
        error = found.x - truth
        pulls.append(error @ found.information @ error)
    # Sum of 200 chi-squares of four degrees of freedom: 800 with a standard deviation of 40.
    assert np.sum(pulls) == pytest.approx(800, abs=160)


@pytest.mark.parametrize("seed", range(8))
def test_one_parameter_at_its_limit_leaves_the_others_at_their_best(seed):
    """Uncorrelated with the rest, so that the limit concerns that parameter alone."""
    rng = np.random.default_rng(seed)
    A = np.linalg.qr(rng.standard_normal((30, 3)))[0] * 20
    y = A @ np.array([1.0, -0.5, 2.0]) + rng.standard_normal(30)
    mean, precision, bounds = np.zeros(3), 0.1 * np.eye(3), (np.full(3, -3.0), np.array([0.4, 3.0, 3.0]))
    found = minimise(
        lambda x: (y - A @ x, A), np.zeros(3), mean=mean, precision=precision, tolerance=1e-9,
        steps=StepRule(bounds=bounds),
    )  # fmt: skip
    cost, best = reference(lambda x: y - A @ x, np.zeros(3), mean, precision, bounds)
    assert found.x[0] == 0.4
    np.testing.assert_allclose(found.x, best, atol=1e-4)
    assert found.cost == pytest.approx(cost, rel=1e-6)


def test_correlated_parameters_give_way_to_the_one_at_its_limit():
    excess = []
    for seed in range(20):
        A, y, mean, precision = line(seed)
        bounds = (mean - 0.3, mean + 0.3)
        found = minimise(
            lambda x, A=A, y=y: (y - A @ x, A), mean, mean=mean, precision=precision, iterations=100,
            steps=StepRule(bounds=bounds),
        )  # fmt: skip
        cost, _ = reference(lambda x, A=A, y=y: y - A @ x, mean, mean, precision, bounds)
        assert np.all((found.x >= bounds[0]) & (found.x <= bounds[1]))
        excess.append((found.cost - cost) / cost)
    assert np.max(excess) < 1e-4


@pytest.mark.parametrize("seed", range(10))
def test_a_linear_problem_that_limits_hold_is_solved_as_a_textbook_active_set_method_does(seed):
    """A smooth curve with many values at a limit: the free minimum does not tell which."""
    rng = np.random.default_rng(seed)
    n = 40
    A = rng.standard_normal((n, n)) * 10.0 ** rng.uniform(-1, 1, n)
    y = A @ rng.standard_normal(n)
    smooth = 10.0 ** rng.uniform(-1, 3) * np.diff(np.eye(n), 3, axis=0)
    precision = smooth.T @ smooth + 1e-3 * np.eye(n)
    bounds = -np.abs(rng.standard_normal(n)) * rng.integers(0, 2, n), np.abs(rng.standard_normal(n))
    found = minimise(
        lambda x: (y - A @ x, A), np.zeros(n), mean=np.zeros(n), precision=precision, tolerance=1e-9,
        steps=StepRule(bounds=bounds),
    )  # fmt: skip
    rows = np.vstack([A, np.linalg.cholesky(precision).T])
    lower = np.minimum(bounds[0], -1e-12)  # the reference wants room
    best = lsq_linear(rows, np.append(y, np.zeros(n)), (lower, bounds[1]), method="bvls", tol=1e-14)
    assert np.count_nonzero(best.active_mask) > 4
    assert found.ended == "settled"
    assert found.cost == pytest.approx(2 * best.cost, rel=1e-6)


def test_a_smooth_curve_at_a_limit_stays_smooth():
    """Cut off at its limit alone, a value tears the curve: each step then costs more, and the search is stuck."""
    x = np.linspace(0.0, 1.0, 30)
    curve = 2.0 * x - 0.3
    third = np.diff(np.eye(30), 3, axis=0)
    precision, bounds = 1e7 * third.T @ third + 1e-3 * np.eye(30), (np.zeros(30), np.full(30, np.inf))
    start = np.maximum(curve, 0.0)
    mean = np.zeros(30)
    found = minimise(
        lambda x: (10.0 * (curve - x), 10.0 * np.eye(30)), start, mean=mean, precision=precision, tolerance=1e-6,
        steps=StepRule(bounds=bounds, largest=np.ones(30)),
    )  # fmt: skip
    cost, _ = reference(lambda x: 10.0 * (curve - x), start, mean, precision, bounds)
    assert found.ended == "settled"
    assert found.cost < (1 + 1e-6) * cost


def test_a_start_beyond_a_limit_begins_at_it():
    """Else every step, cut to the limits, costs more than the start, and none is taken."""
    A, y, mean, precision = line(5)
    lower, upper = np.full(4, -10.0), np.full(4, 10.0)
    best = minimise(lambda x: (y - A @ x, A), np.zeros(4), mean=mean, precision=precision, tolerance=1e-12)
    lower[2] = best.x[2] + 0.5
    inside, beyond = (
        minimise(
            lambda x: (y - A @ x, A),
            start,
            mean=mean,
            precision=precision,
            tolerance=1e-9,
            steps=StepRule(bounds=(lower, upper)),
        )
        for start in (lower, best.x)
    )
    assert beyond.settled
    assert beyond.cost == pytest.approx(inside.cost, rel=1e-6)


def test_residuals_that_are_not_finite_only_shorten_the_step():
    def evaluate(x):
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.array([np.log(x[0]) - np.log(1e-3)]), np.array([[-1 / x[0]]])

    found = minimise(
        evaluate, np.array([1.0]), mean=np.zeros(1), precision=np.array([[1e-12]]), iterations=100, tolerance=1e-12
    )
    assert found.x[0] == pytest.approx(1e-3, rel=1e-4)


def test_no_iteration_moves_a_parameter_farther_than_allowed():
    seen = []

    def evaluate(x):
        seen.append(x.copy())
        return np.array([10.0, -20.0]) - x, np.eye(2)

    found = minimise(
        evaluate, np.zeros(2), mean=np.zeros(2), precision=1e-9 * np.eye(2),
        steps=StepRule(largest=np.array([1.0, 4.0])),
    )  # fmt: skip
    moves = np.abs(np.diff(np.array(seen), axis=0))
    assert np.all(moves <= np.array([1.0, 4.0]) * (1 + 1e-12))
    # Both are shortened together, so that the direction stays Newton's.
    np.testing.assert_allclose(moves[0], [1.0, 2.0], rtol=1e-9)
    np.testing.assert_allclose(found.x, [10.0, -20.0], rtol=1e-6)


def test_a_start_at_the_minimum_stays_there():
    found = minimise(lambda x: (np.zeros(2), np.eye(2)), np.ones(2), mean=np.ones(2), precision=np.eye(2))
    np.testing.assert_array_equal(found.x, 1.0)
    assert found.history == (0.0,)


def bent(x):
    """A valley along a parabola, steep across and flat along it; and its derivative."""
    return np.array([100 * (x[1] - x[0] ** 2), x[0] - 3.0]), np.array([[-200 * x[0], 100], [1.0, 0.0]])


def test_along_a_bent_valley_steps_that_turn_arrive_where_straight_ones_do_not():
    """Straight steps must stay within the valley's width, whatever direction is best."""

    def fit(**more):
        def evaluate(x):
            r, J = bent(x)
            return -r, J

        return minimise(
            evaluate, np.array([-1.0, 1.0]), mean=np.zeros(2), precision=1e-12 * np.eye(2), iterations=60,
            tolerance=1e-9, steps=StepRule(**more),
        )  # fmt: skip

    turning, straight = fit(residual_alone=lambda x: -bent(x)[0]), fit()
    np.testing.assert_allclose(turning.x, [3.0, 9.0], rtol=1e-4)
    assert straight.cost > 1.0


def test_steps_along_a_power_law_arrive_where_straight_ones_are_still_on_their_way():
    """A force that grows with a power of its place: only the product is known sharply, and the place a little."""

    def evaluate(x):
        k, at = x
        r = np.array([1e3 * (k * at**6 - 1.0), 10.0 * (at - 0.8)])
        return -r, np.array([[1e3 * at**6, 6e3 * k * at**5], [0.0, 10.0]])

    def by_a_factor(x, step):
        return np.array([x[0] * np.exp(step[0] / x[0]), x[1] + step[1]])

    def fit(**more):
        return minimise(
            evaluate, np.ones(2), mean=np.zeros(2), precision=1e-12 * np.eye(2), iterations=12, tolerance=1e-6,
            steps=StepRule(residual_alone=lambda x: evaluate(x)[0], **more),
        )  # fmt: skip

    bent, straight = fit(moved=by_a_factor), fit()
    np.testing.assert_allclose(bent.x, [0.8**-6, 0.8], rtol=1e-3)
    assert bent.cost < 0.1 * straight.cost


def test_a_step_that_damping_kept_short_does_not_end_a_search():
    """Its little gain says nothing of how far the minimum is."""
    A = np.zeros((200, 2))
    A[:2] = [[1e4, 1e4], [0.0, 10.0]]
    y = A @ [-1.0, 1.0]
    found = minimise(
        lambda x: (y - A @ x, A), np.zeros(2), mean=np.zeros(2), precision=1e-12 * np.eye(2), tolerance=1.0
    )
    assert found.settled
    assert found.history[0] - found.history[1] < 1.0 < 90.0 < found.history[0] - found.cost


def test_every_search_tells_how_it_ended():
    A, y, mean, precision = line(1)
    found = minimise(lambda x: (y - A @ x, A), np.zeros(4), mean=mean, precision=precision)
    assert found.settled
    assert found.ended == "settled"
    nowhere = minimise(lambda x: (np.full(2, np.nan), np.eye(2)), np.ones(2), mean=np.zeros(2), precision=np.eye(2))
    assert nowhere.ended == "not finite"
    np.testing.assert_array_equal(nowhere.x, 1.0)

    def valley(x):
        r, J = bent(x)
        return -r, J

    start, flat = np.array([-1.0, 1.0]), 1e-12 * np.eye(2)
    short = minimise(valley, start, mean=np.zeros(2), precision=flat, iterations=5, tolerance=1e-9)
    assert short.ended == "out of iterations"

    def uphill(x):
        """Of a slope with the wrong sign."""
        return np.array([10.0 + x[0]]), np.array([[1.0]])

    lost = minimise(uphill, np.zeros(1), mean=np.zeros(1), precision=1e-12 * np.eye(1))
    assert lost.ended == "stuck"
    assert not lost.settled


def test_a_parameter_without_effect_and_without_a_prior_only_stays_where_it_is():
    A = np.array([[1.0, 0.0], [2.0, 0.0]])
    y = np.array([1.0, 2.0])
    for nothing in (0.0, 1e-320):
        found = minimise(
            lambda x: (y - A @ x, A), np.array([0.0, 5.0]), mean=np.zeros(2), precision=np.diag([1e-9, nothing])
        )
        assert np.isfinite(found.x).all()


def test_a_step_that_fails_costs_no_derivatives():
    """A narrow bent valley: most of the trials fail, and the way is the same as with all derivatives computed."""

    def residual(x):
        return np.array([1.0 - x[0], 30.0 * (x[0] ** 2 - x[1])])

    counted = []

    def evaluate(x):
        counted.append(x)
        return residual(x), np.array([[1.0, 0.0], [-60.0 * x[0], 30.0]])

    found = minimise(
        evaluate, np.array([-2.0, 1.0]), mean=np.zeros(2), precision=1e-6 * np.eye(2), iterations=100, tolerance=1e-9,
        steps=StepRule(residual_alone=residual),
    )  # fmt: skip
    np.testing.assert_allclose(found.x, [1.0, 1.0], rtol=1e-3)
    # The start, each step that was taken, and the first that failed: before it none was expected to.
    assert len(counted) <= len(found.history) + 1


def test_a_search_whose_time_is_up_ends_where_it_is():
    A, y, mean, precision = line(2)
    with time_limit(time.monotonic()):
        found = minimise(lambda x: (y - A @ x, A), np.ones(4), mean=mean, precision=precision)
    assert found.ended == "out of time"
    np.testing.assert_array_equal(found.x, np.ones(4))


@dataclass(frozen=True)
class Held:
    """A search for two, whose residual is believed to change by `slope` times what it does, and its weight at x."""

    x: np.ndarray
    slope: float = 1.0
    weight: Callable[[float], float] = lambda x: 1.0

    def begun_at(self, x):
        return replace(self, x=x)

    def solve(self, *, iterations):
        weight, slope = self.weight(self.x[0]), self.slope
        return minimise(
            lambda x: (weight * (2.0 - self.x - slope * (x - self.x)), np.array([[weight * slope]])), self.x,
            mean=np.zeros(1), precision=1e-12 * np.eye(1), iterations=iterations, tolerance=1e-9,
        )  # fmt: skip

    def cost_at(self, there):
        return float((self.weight(self.x[0]) * (2.0 - there.x[0])) ** 2)


def test_rounds_end_where_new_weights_gain_nothing():
    begun = Held(np.zeros(1), weight=lambda x: 1.0 + 0.1 * x)
    found = minimise_reweighted(begun, rounds=4, tolerance=0.1, iterations=9)
    assert found.settled
    assert found.x == pytest.approx(2.0, abs=0.01)


def test_a_round_that_leads_beyond_what_it_holds_is_taken_in_part():
    """Each steps three times too far."""
    found = minimise_reweighted(Held(np.zeros(1), slope=1 / 3), rounds=12, tolerance=1e-6, iterations=9)
    assert found.x == pytest.approx(2.0, abs=0.01)


def test_of_rounds_no_part_of_which_lowers_the_cost_the_beginning_is_kept():
    found = minimise_reweighted(Held(np.array([1.5]), slope=-1.0), rounds=4, tolerance=1e-9, iterations=9)
    assert found.ended == "stuck"
    assert found.x == 1.5
    assert found.cost == pytest.approx(0.25)


def test_a_round_is_no_worse_for_a_larger_weight_where_it_ends():
    begun = Held(np.zeros(1), slope=1.2, weight=lambda x: 1e3 if x > 1 else 1.0)
    found = minimise_reweighted(begun, rounds=9, tolerance=1e-9, iterations=9)
    assert found.x == pytest.approx(2.0, abs=1e-4)
