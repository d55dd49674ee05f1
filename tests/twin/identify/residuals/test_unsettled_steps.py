"""A step whose balance was not found says nothing: neither its fundamental nor its harmonics are witnesses."""

import numpy as np

from twin.identify.nonlinear.balance import Added, Balance
from twin.identify.residuals.whitening import HarmonicResiduals

NONE = np.zeros((3, 0), complex)


def test_only_what_was_not_found_counts_as_missed_and_at_most_as_a_whole_response():
    balance = Balance(NONE, NONE, Added.nothing(NONE.shape, 0), np.array([1e-12, 0.1, np.nan]))
    np.testing.assert_array_equal(balance.missed, [0.0, 0.1, 1.0])


def test_harmonics_beside_an_unsettled_balance_err_by_as_much_of_themselves():
    residual = np.array([[[1.0 + 1j, 2.0]], [[3.0, 4.0]]])
    harmonics = HarmonicResiduals(
        np.array([3]), residual, np.tile(np.eye(2) + 0j, (2, 1, 1, 1)), np.zeros((2, 1, 2, 0), complex),
        np.zeros((2, 1, 2, 0), complex), None,
    )  # fmt: skip
    assert harmonics.beside(np.zeros(2)) is harmonics
    found = harmonics.beside(np.array([0.0, 0.5])).covariance
    np.testing.assert_allclose(found[0, 0], np.eye(2))
    np.testing.assert_allclose(found[1, 0], np.diag([1 + 0.25 * 9, 1 + 0.25 * 16]))
