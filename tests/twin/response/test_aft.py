"""Harmonics of a law's steady force: compiled against plain, exact Jacobian, and the law's own describing function."""

from __future__ import annotations

import numpy as np
import pytest
from harmonic_balance_numpy import alternate_numpy, alternate_pair_numpy

from twin.bench.force_factor import ForceFactor
from twin.joint import Cubic, ForceTable, Linear, PiecewiseLinearContact, Polynomial, RunningLoss, Saturating, iwan
from twin.response.aft import aft_kernel, alternate_pair, fourier_basis, running

H, SAMPLES = 5, 512
LAWS = [
    Cubic(2.0),
    Saturating(2.0, 0.8, -0.5),
    PiecewiseLinearContact((1.0, 2.0, 6.0), (0.5, 0.0, -0.5), (-1, -1, -1)),
    iwan(2.0, 1.5, sliders=5),
    Polynomial((-1.0, 0.5), (0.3, 0.2), stick=0.3),
    ForceTable.of(np.tanh, limit_m=3.0),
    Linear(1.7),
]
RUNNING = RunningLoss(5.0, np.linspace(0.0, 2.0, 11) ** 2)
BASIS = fourier_basis(H, SAMPLES)
C = np.array([0.1, 0.3, 1.6, 0.1, -0.2, 0.05, 0.02, 0.1, 0.0, 0.01, 0.03])


def harmonics(law, c, function=None):
    F, J = np.zeros(len(c)), np.zeros((len(c), len(c)))
    (function or aft_kernel(law.kind, law.parameters))(law.kind, law.parameters[None], 0, c, BASIS, F, J)
    return F, J


def running_harmonics(c, offset=0.0, omega=7.0):
    F, J, by = np.zeros(len(c)), np.zeros((len(c), len(c))), np.zeros((2, len(c)))
    running(RUNNING.parameters[None], 0, c, offset, omega, F, J, by)
    return F, J, *by


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
    "law",
    [*LAWS[:4], Polynomial((-1.0, 0.5), (0.3, 0.2), stick=1e-3), LAWS[5], LAWS[6]],
    ids=lambda law: type(law).__name__,
)
def test_fundamental_of_a_sine_is_the_describing_function(law):
    c = np.zeros(2 * H + 1)
    c[2] = 1.3
    F, _ = harmonics(law, c)
    expected = complex(law.describing_function(np.array(1.3))) * 1.3
    # The polynomial's loss reverses within a travel, which keeps a little of it as stiffness.
    assert F[2] == pytest.approx(expected.real, abs=0.1 if isinstance(law, Polynomial) else 2e-3)
    assert F[1] == pytest.approx(expected.imag, abs=2e-3)


def test_running_loss_is_a_loss_modulus_on_a_velocity():
    c = np.zeros(2 * H + 1)
    c[1] = 7.0 * 1.3  # velocity of 1.3 sin(7 t)
    F, *_ = running_harmonics(c)
    assert F[1] == pytest.approx(RUNNING.describing_function(np.array(1.3)).imag * 1.3, rel=1e-12)


def test_running_loss_counts_a_static_offset_as_its_means_do():
    c = np.zeros(2 * H + 1)
    c[1] = 7.0 * 1.3
    F, *_ = running_harmonics(c, offset=0.4)
    t = 2 * np.pi * np.arange(256) / 256
    e, v = 0.4 + 1.3 * np.sin(t), 7.0 * 1.3 * np.cos(t)
    A, w = np.sqrt(2 * np.mean(e**2)), np.sqrt(np.mean(v**2) / np.mean(e**2))
    assert F[1] == pytest.approx(RUNNING.modulus(A) / w * c[1], rel=1e-12)


def test_running_loss_has_exact_derivatives():
    c, offset, omega, d = 3.0 * C, 0.3, 7.0, 1e-6
    _, J, by_offset, by_omega = running_harmonics(c, offset, omega)
    for column, unit in zip(J.T, np.eye(len(c)), strict=True):
        difference = running_harmonics(c + d * unit, offset)[0] - running_harmonics(c - d * unit, offset)[0]
        np.testing.assert_allclose(column, difference / (2 * d), atol=1e-7)
    shifted = [running_harmonics(c, offset + s * d)[0] for s in (1, -1)]
    np.testing.assert_allclose(by_offset, (shifted[0] - shifted[1]) / (2 * d), atol=1e-7)
    shifted = [running_harmonics(c, offset, omega + s * d)[0] for s in (1, -1)]
    np.testing.assert_allclose(by_omega, (shifted[0] - shifted[1]) / (2 * d), atol=1e-7)


def test_a_force_factor_turns_one_coordinate_by_the_other():
    """Against products of the samples; compiled against plain; exact derivatives by both coordinates."""
    p = np.array([ForceFactor(2.0, 0.9, "current").parameters_at(0, 1)])
    x, z = C, np.roll(C, 2)
    n = len(C)
    results = []
    for function in (alternate_pair, alternate_pair_numpy):
        F, J = np.zeros(n), np.zeros((2, n, n))
        function(p, 0, x, z, BASIS, F, J)
        results.append((F, *J))
    for compiled, plain in zip(*results, strict=True):
        np.testing.assert_allclose(compiled, plain, rtol=1e-10, atol=1e-13)
    e, y = x @ BASIS, z @ BASIS
    lost = 2.0 * (1 / (1 + (e / 0.9) ** 2) - 1) * y
    assert results[0][0][0] == pytest.approx(lost.mean(), rel=1e-12)
    d = 1e-6
    for which in (1, 2):
        for column, unit in zip(results[0][which].T, np.eye(n), strict=True):
            moved = []
            for s in (1, -1):
                F = np.zeros(n)
                shift = s * d * unit
                pair = (x + shift, z) if which == 1 else (x, z + shift)
                alternate_pair(p, 0, *pair, BASIS, F, np.zeros((2, n, n)))
                moved.append(F)
            np.testing.assert_allclose(column, (moved[0] - moved[1]) / (2 * d), atol=1e-7)
