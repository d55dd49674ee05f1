"""Tikhonov's strength by the L-curve and by cross-validation, on ill-posed integral equations with known solutions."""

import numpy as np
import pytest

from twin.identify.l_curve import decompose


def shaw(n):
    """Shaw's image restoration: K(s, t) = (cos s + cos t)^2 (sin u / u)^2, u = pi (sin s + sin t); midpoint rule."""
    s = (np.arange(n) + 0.5) * np.pi / n - np.pi / 2
    u = np.pi * (np.sin(s)[:, None] + np.sin(s))
    K = (np.cos(s)[:, None] + np.cos(s)) ** 2 * np.sinc(u / np.pi) ** 2 * np.pi / n
    x = 2 * np.exp(-6 * (s - 0.8) ** 2) + np.exp(-2 * (s + 0.5) ** 2)
    return K, x


def phillips(n):
    """Phillips' equation on (-6, 6): K = phi(s - t), x = phi, phi(u) = 1 + cos(pi u / 3) for |u| < 3; midpoint rule."""
    s = -6 + 12 * (np.arange(n) + 0.5) / n

    def phi(u):
        return np.where(np.abs(u) < 3, 1 + np.cos(np.pi * u / 3), 0.0)

    return phi(s[:, None] - s) * 12 / n, phi(s)


def noisy(problem, noise, seed):
    """The decomposed problem with noise of a relative size, and the relative error of a solution by its strength."""
    K, x = problem(64)
    exact = K @ x
    b = exact + noise * np.linalg.norm(exact) / 8 * np.random.default_rng(seed).standard_normal(64)
    tikhonov = decompose(K, b)
    return tikhonov, lambda strength: np.linalg.norm(tikhonov.solve(strength) - x) / np.linalg.norm(x)


@pytest.mark.parametrize(
    ("problem", "choice"), [(shaw, "corner"), (shaw, "cross_validated"), (phillips, "cross_validated")]
)
@pytest.mark.parametrize("noise", [1e-2, 1e-3, 1e-4])
def test_the_choice_comes_near_the_best_strength(problem, choice, noise):
    ratios = []
    for seed in range(9):
        tikhonov, error = noisy(problem, noise, seed)
        curve = tikhonov.l_curve()
        ratios.append(error(getattr(curve, choice)) / min(error(strength) for strength in curve.strength))
    assert np.median(ratios) < 2


@pytest.mark.parametrize(("noise", "gain"), [(1e-2, 1000), (1e-3, 100), (1e-4, 5)])
def test_the_corner_stays_on_the_weak_side_for_a_smooth_solution(noise, gain):
    """Known of the L-curve: as smooth a solution as Phillips' deserves more strength; it still beats none by far."""
    tikhonov, error = noisy(phillips, noise, 0)
    curve = tikhonov.l_curve()
    assert curve.corner < curve.cross_validated
    assert error(curve.corner) < error(0.0) / gain


def test_solution_and_norms_are_those_of_the_augmented_least_squares_problem():
    rng = np.random.default_rng(3)
    S, eps = rng.standard_normal((30, 6)) * np.logspace(0, -4, 6), rng.standard_normal(30)
    tikhonov = decompose(S, eps)
    curve = tikhonov.l_curve(9)
    for strength, rho, eta in zip(curve.strength, curve.residual_norm, curve.solution_norm, strict=True):
        augmented = np.vstack([S, strength * np.eye(6)])
        x = np.linalg.lstsq(augmented, np.concatenate([eps, np.zeros(6)]), rcond=None)[0]
        np.testing.assert_allclose(tikhonov.solve(strength), x, rtol=1e-7)
        assert rho == pytest.approx(np.linalg.norm(S @ x - eps), rel=1e-9)
        assert eta == pytest.approx(np.linalg.norm(x), rel=1e-7)


def test_curvature_is_that_of_the_drawn_curve():
    K, x = shaw(40)
    b = K @ x + 1e-3 * np.random.default_rng(0).standard_normal(40)
    curve = decompose(K, b).l_curve(4000)
    u, v, t = np.log(curve.residual_norm), np.log(curve.solution_norm), np.log(curve.strength)
    du, dv = np.gradient(u, t), np.gradient(v, t)
    drawn = (du * np.gradient(dv, t) - np.gradient(du, t) * dv) / (du**2 + dv**2) ** 1.5
    inside = slice(200, -200)
    # Positive at the corner, where log eta falls before log rho rises; central differences are good to a few 1e-4.
    np.testing.assert_allclose(curve.curvature[inside], drawn[inside], rtol=0.02, atol=0.02)
    assert curve.curvature.max() > 1


def test_a_right_hand_side_of_zero_asks_for_no_change():
    tikhonov = decompose(np.eye(3), np.zeros(3))
    assert tikhonov.l_curve().corner == 0.0
    np.testing.assert_array_equal(tikhonov.solve(1.0), 0.0)


@pytest.mark.parametrize(("problem", "size"), [(shaw, 32), (phillips, 64)])
def test_cross_validation_is_that_of_the_influence_matrix(problem, size):
    """|(1 - A) b|^2 / trace(1 - A)^2 with A = K (K'K + lambda^2)^-1 K' written out (Golub, Heath and Wahba 1979)."""
    K, x = problem(size)
    b = K @ x + 1e-2 * np.random.default_rng(6).standard_normal(size)
    curve = decompose(K, b).l_curve(25)
    for strength, value in zip(curve.strength, curve.cross_validation, strict=True):
        if strength < 1e-5 * curve.strength[-1]:
            continue  # the normal equations of the check itself lose all digits there
        rest = np.eye(size) - K @ np.linalg.solve(K.T @ K + strength**2 * np.eye(size), K.T)
        assert value == pytest.approx(np.sum((rest @ b) ** 2) / np.trace(rest) ** 2, rel=1e-5)


def test_cross_validation_predicts_rows_that_were_left_out():
    """Its minimum beside the plain leave-one-out errors, which it approximates without leaving anything out."""
    K, x = shaw(32)
    b = K @ x + 2e-2 * np.random.default_rng(7).standard_normal(32)
    curve = decompose(K, b).l_curve(60)

    def left_out(strength):
        errors = []
        for row in range(32):
            rest = np.delete(np.arange(32), row)
            errors.append(K[row] @ decompose(K[rest], b[rest]).solve(strength) - b[row])
        return np.mean(np.square(errors))

    by_strength = np.array([left_out(strength) for strength in curve.strength])
    chosen = by_strength[np.argmin(curve.cross_validation)]
    assert chosen < 1.2 * by_strength.min()
    assert by_strength[-1] > 1.5 * by_strength.min()


def test_a_problem_with_fewer_rows_than_unknowns_has_the_least_solution():
    rng = np.random.default_rng(8)
    S, eps = rng.standard_normal((5, 9)), rng.standard_normal(5)
    np.testing.assert_allclose(decompose(S, eps).solve(0.0), np.linalg.lstsq(S, eps, rcond=None)[0], rtol=1e-10)
    curve = decompose(S, eps).l_curve()
    assert np.all(np.isfinite(curve.cross_validation))
    assert np.all(np.diff(curve.residual_norm) >= 0)
    assert np.all(np.diff(curve.solution_norm) <= 0)
