"""Cholesky factors of information matrices, against the same in well-scaled unknowns."""

import numpy as np
import pytest

from twin.identify.cholesky import Cholesky


def test_unknowns_of_any_scale_are_found_as_well_as_those_of_one():
    """Moduli of 1e8 beside losses of 1e-3, as a fit has them."""
    rng = np.random.default_rng(1)
    J = rng.standard_normal((60, 40))
    alike, right = J.T @ J, rng.standard_normal(40)
    scale = 10.0 ** rng.uniform(-8, 8, 40)
    found = Cholesky.of(alike * scale * scale[:, None])
    assert found.solve(right * scale) * scale == pytest.approx(np.linalg.solve(alike, right), rel=1e-8)
    expected = np.linalg.slogdet(alike)[1] + 2 * np.sum(np.log(scale))
    assert found.log_determinant == pytest.approx(expected, rel=1e-12)
    assert found.inverse * scale * scale[:, None] == pytest.approx(np.linalg.inv(alike), rel=1e-6, abs=1e-10)


def test_what_is_not_positive_definite_is_refused():
    with pytest.raises(np.linalg.LinAlgError):
        Cholesky.of(np.diag([1.0, -1.0]))
