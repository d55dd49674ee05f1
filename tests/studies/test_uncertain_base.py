"""Parameters known only so well, as noise: against dense generalised least squares."""

import numpy as np
import pytest

from studies.uncertain_base import UncertainBase


@pytest.fixture
def problem():
    rng = np.random.default_rng(4)
    S, B = rng.standard_normal((40, 3)), rng.standard_normal((40, 5))
    root = rng.standard_normal((5, 5)) * [3.0, 1.0, 0.1, 1e-3, 0.0]
    return S, B, root @ root.T, rng.standard_normal(40), 0.3**2


def test_whitened_least_squares_are_generalised_ones(problem):
    S, B, covariance, residual, variance = problem
    whole = variance * np.eye(40) + B @ covariance @ B.T
    expected = np.linalg.solve(S.T @ np.linalg.solve(whole, S), S.T @ np.linalg.solve(whole, residual))
    uncertain = UncertainBase.of(B, covariance, variance)
    found, *_ = np.linalg.lstsq(uncertain.whiten(S), uncertain.whiten(residual), rcond=None)
    np.testing.assert_allclose(found, expected, rtol=1e-9)
    np.testing.assert_allclose(
        uncertain.whiten(whole) @ uncertain.whiten(np.eye(40)).T, variance * np.eye(40), atol=1e-9
    )


def test_what_is_left_moves_the_parameters_as_far_as_they_are_free(problem):
    _, B, covariance, residual, variance = problem
    whole = variance * np.eye(40) + B @ covariance @ B.T
    found = UncertainBase.of(B, covariance, variance).change(residual)
    np.testing.assert_allclose(found, covariance @ B.T @ np.linalg.solve(whole, residual), atol=1e-9)


def test_exact_parameters_change_nothing(problem):
    S, B, _, residual, variance = problem
    exact = np.zeros((5, 5))
    for known, noise in ((exact, variance), (np.eye(5), np.inf), (exact, 0.0)):
        uncertain = UncertainBase.of(B, known, noise)
        np.testing.assert_allclose(uncertain.whiten(S), S, atol=1e-12)
        np.testing.assert_allclose(uncertain.change(residual), 0.0, atol=1e-12)
