"""Whitening against dense algebra."""

import numpy as np
import pytest

from twin.identify.residuals.whitening import LowRankWhitening, Whitening


@pytest.mark.parametrize("size", [0.0, 1e-3, 1.0, 1e3])
def test_columns_with_standard_normal_amounts_are_whitened_away(size):
    """Also where two of them are one, and where there are none."""
    rng = np.random.default_rng(7)
    columns = size * rng.standard_normal((30, 4))
    columns[:, 3] = columns[:, 2]
    whitening = LowRankWhitening.of(columns)
    white = whitening(np.eye(30))
    np.testing.assert_allclose(
        white @ (np.eye(30) + columns @ columns.T) @ white.T, np.eye(30), atol=1e-9 * (1 + size**2)
    )
    values = rng.standard_normal(30)
    np.testing.assert_allclose(whitening(values), white @ values, atol=1e-9)
    np.testing.assert_array_equal(LowRankWhitening.of(columns[:, :0])(values), values)


def test_a_covariance_that_rounding_makes_indefinite_is_whitened_too():
    """Of sixteen responses that share one error of a million times their noise."""
    shared = np.linspace(1.0, 2.0, 16)[:, None] * 1e6
    covariance = np.stack([np.eye(16), shared @ shared.T + 1e-8 * np.eye(16)])
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(covariance)
    white = Whitening.of(covariance).columns(shared[None].repeat(2, axis=0))
    assert np.all(np.isfinite(white))
    assert np.linalg.norm(white[16:]) == pytest.approx(1.0, rel=1e-6)
