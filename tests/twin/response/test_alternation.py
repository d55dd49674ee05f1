"""Harmonics of a law's steady force: compiled against plain, exact Jacobian, and the law's own describing function."""

from __future__ import annotations

import numpy as np
import pytest

from twin.joint import Cubic, Polynomial, RunningLoss, Saturating, Table, iwan, mayer_gaul
from twin.response.alternation import alternate, alternate_numpy, fourier_basis

H, SAMPLES = 5, 512
LAWS = [
    Cubic(2.0),
    Saturating(2.0, 0.8, -0.5),
    mayer_gaul(1.0, 3.0, 9.0, 0.5),
    iwan(2.0, 1.5, sliders=5),
    Polynomial((-1.0, 0.5), (0.3, 0.2), stick=0.3),
    Table.of(np.tanh, limit_m=3.0),
    RunningLoss(5.0, np.linspace(0.0, 2.0, 11) ** 2),
]
BASIS = fourier_basis(H, SAMPLES)
C = np.array([0.1, 0.3, 1.6, 0.1, -0.2, 0.05, 0.02, 0.1, 0.0, 0.01, 0.03])


def harmonics(law, c, function=alternate):
    F, J = np.zeros(len(c)), np.zeros((len(c), len(c)))
    function(law.kind, law.parameters[None], 0, c, BASIS, 7.0, F, J)
    return F, J


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_compiled_and_plain_agree(law):
    for compiled, plain in zip(harmonics(law, C), harmonics(law, C, alternate_numpy), strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: type(law).__name__)
def test_jacobian_is_the_derivative(law):
    _, J = harmonics(law, C)
    d = 1e-7
    differences = np.column_stack(
        [(harmonics(law, C + d * unit)[0] - harmonics(law, C - d * unit)[0]) / (2 * d) for unit in np.eye(len(C))]
    )
    # A sample at the very moment of a kink, or a node of a table, may fall on either side.
    assert np.abs(J - differences).max() < 0.02 * np.abs(J).max()
    assert np.median(np.abs(J - differences)) < 1e-6 * np.abs(J).max() + 1e-7


@pytest.mark.parametrize(
    "law", [*LAWS[:4], Polynomial((-1.0, 0.5), (0.3, 0.2), stick=1e-3), LAWS[5]], ids=lambda law: type(law).__name__
)
def test_fundamental_of_a_sine_is_the_describing_function(law):
    c = np.zeros(2 * H + 1)
    c[2] = 1.3
    F, _ = harmonics(law, c)
    expected = complex(law.stiffness(np.array(1.3))) * 1.3
    # The polynomial's loss reverses within a travel, which keeps a little of it as stiffness.
    assert F[2] == pytest.approx(expected.real, abs=0.1 if isinstance(law, Polynomial) else 2e-3)
    assert F[1] == pytest.approx(expected.imag, abs=2e-3)


def test_running_loss_is_a_loss_modulus_on_a_velocity():
    law = LAWS[6]
    c = np.zeros(2 * H + 1)
    c[1] = 7.0 * 1.3  # velocity of 1.3 sin(7 t)
    F, _ = harmonics(law, c)
    assert F[1] == pytest.approx(law.stiffness(np.array(1.3)).imag * 1.3, rel=1e-12)
