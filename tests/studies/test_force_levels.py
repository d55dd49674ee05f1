"""A level that the law has not seen: predicted where the law is the joint's own, and not where it follows the force."""

from dataclasses import replace

import numpy as np
import pytest

from studies.force_levels import predict_left_out
from studies.polynomial_law import PolynomialProblem
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

SOFTENING, LOSS = np.array([2e6, 5e10, 8e12]), np.array([5e6, 3e10])
LEVELS = np.repeat([0, 1, 2], 25)


@pytest.fixture(scope="module")
def problem(build, steel_model, steel_dense):
    """Three sweeps of a dense structure that has polynomials; `stray` multiplies the middle one's softening."""
    base = nominal_parameters(load_rig("steel-lap-joint"))
    reference_omega = float(steel_model.basis.omega[0])
    omega = np.tile(2 * np.pi * np.linspace(25.8, 27.0, 25), 3)
    near = 0.2 + 0.8 / (1 + ((omega / (2 * np.pi) - 26.4) / 0.3) ** 2)
    X = np.array([5e-4, 1e-3, 2e-3])[LEVELS] * near

    def make(stray=1.0):
        g1, g2, _ = steel_dense.moduli(omega, X, base, SOFTENING, LOSS)
        H = steel_dense.accelerance(omega, base, -g1 * np.where(LEVELS == 1, stray, 1.0), 1j * g2)
        force = X * reference_omega**2 / np.abs(H[:, 1])
        steps = build.steps(omega, force[:, None], (H * force[:, None])[:, :, None])
        return PolynomialProblem.of(ResidualModel(build.evidence(steel_model, steps)), base, np.zeros((14, 14)))

    return make


def test_a_level_of_the_same_law_is_predicted_from_its_forces_alone(problem):
    found = predict_left_out(problem(), LEVELS == 1)
    assert found.at_amplitude_percent < 0.02
    assert found.at_force_percent < 0.05
    assert (found.lost, found.extrapolated) == (0, False)


def test_a_level_with_a_law_of_its_own_is_not(problem):
    found = predict_left_out(problem(stray=1.1), LEVELS == 1)
    assert found.at_amplitude_percent > 1.0


def test_the_highest_level_is_an_extrapolation_and_called_so(problem):
    assert predict_left_out(problem(), LEVELS == 2).extrapolated


def test_at_forces_that_fold_the_response_a_step_whose_branch_has_ended_is_counted(problem):
    """Twice the force at each measured amplitude: three states below the resonance, and one step just past a fold."""
    whole = problem()
    middle = LEVELS == 1
    folded = replace(whole, measured=np.where(middle, 0.5 * whole.measured, whole.measured))
    assert predict_left_out(folded, middle).lost == 1
