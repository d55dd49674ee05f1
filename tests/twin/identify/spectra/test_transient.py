"""The free decays at a record's ends are those of a least-squares fit with every line's full covariance."""

import numpy as np
import pytest

from twin.identify.spectra.broadband import _transient


@pytest.mark.parametrize("outputs", [1, 2, 5])
@pytest.mark.parametrize("Su", [0.0, 1e-3, 1.0])
def test_it_is_the_fit_of_all_responses_together(outputs: int, Su: float) -> None:
    rng = np.random.default_rng(outputs)
    omega = 2 * np.pi * np.linspace(5.0, 100.0, 60)
    poles = 2 * np.pi * np.array([20.0, 55.0]) * (-0.01 + 1j)
    s = 1j * omega[:, None]
    H = (1 / (s - poles)) @ rng.standard_normal((2, outputs)) * omega[:, None]
    Sy = np.exp(rng.standard_normal(outputs))
    R = rng.standard_normal((60, outputs)) + 1j * rng.standard_normal((60, outputs))
    decays = np.hstack([1 / (s - poles), np.ones_like(s), s / omega[-1], omega[-1] / s])
    A, y = [], []
    for d, h, r in zip(decays, H, R, strict=True):
        values, vectors = np.linalg.eigh(Su * np.outer(h, h.conj()) + np.diag(Sy))
        white = vectors.conj().T / np.sqrt(values)[:, None]
        A.append(white @ np.kron(np.eye(outputs), d))
        y.append(white @ r)
    residues = np.linalg.lstsq(np.vstack(A), np.concatenate(y), rcond=None)[0]
    expected = decays @ residues.reshape(outputs, -1).T
    np.testing.assert_allclose(_transient(R, omega, poles, H, Su, Sy), expected, atol=1e-8 * np.abs(expected).max())
