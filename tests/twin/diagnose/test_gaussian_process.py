"""Smooth functions as columns, against the covariance that they stand for."""

import numpy as np
import pytest

from twin.diagnose.gaussian_process import smooth_columns


@pytest.mark.parametrize("dimensions", [1, 2])
def test_few_columns_have_the_covariance_of_a_squared_exponential(dimensions):
    points = np.random.default_rng(3).uniform(0, 3, (80, dimensions))
    columns = smooth_columns(points)
    squared = sum((points[:, None, k] - points[:, k]) ** 2 for k in range(dimensions))
    np.testing.assert_allclose(columns @ columns.T, np.exp(-squared / 2), atol=0.01)
    assert columns.shape[1] < 30


def test_what_is_far_apart_is_independent_and_what_is_near_alike():
    columns = smooth_columns(np.array([[0.0], [0.05], [9.0]]))
    covariance = columns @ columns.T
    assert covariance[0, 1] > 0.99
    assert abs(covariance[0, 2]) < 1e-6
