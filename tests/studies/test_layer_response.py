"""Analytic sensitivities to the layer's moduli against finite differences, and the model's own full solution."""

import numpy as np
import pytest
from beam_rows import deflection

from studies.layer_response import layer_response
from twin.identify.forward.predict import blank_data
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def layer():
    rig = load_rig("steel-lap-joint")
    omega = 2 * np.pi * np.linspace(24.0, 29.0, 11)
    return layer_response(ResidualModel(blank_data(rig)), nominal_parameters(rig), omega, np.zeros(11))


def difference(function, step):
    """Central difference with one Richardson extrapolation."""
    coarse, fine = ((function(h) - function(-h)) / (2 * h) for h in (step, step / 2))
    return (4 * fine - coarse) / 3


def test_sensitivities_agree_with_finite_differences(layer):
    dE, dG = np.full(11, -1.5e8 + 0j), np.full(11, 4e8j)
    _, by_E, by_G = layer.responses(dE, dG)
    E = difference(lambda h: np.log(layer.responses(dE + h, dG)[0]), 2e5)
    G = difference(lambda h: np.log(layer.responses(dE, dG + 1j * h)[0]), 2e6) / 1j
    assert np.max(np.abs(by_E - E)) < 1e-7 * np.max(np.abs(by_E))
    assert np.max(np.abs(by_G - G)) < 1e-7 * np.max(np.abs(by_G))


def test_responses_are_those_of_the_whole_structure_solved_at_once(layer):
    model = layer.residual_model.model
    s, base = model.structure, nominal_parameters(load_rig("steel-lap-joint"))
    E, G = base.E - 1.5e8, base.G + 4e8j
    H, _, _ = layer.responses(np.full(11, -1.5e8 + 0j), np.full(11, 4e8j))
    M_Phi = s.M @ model.basis.Phi
    C = M_Phi @ np.diag(2 * model.basis.zeta * model.basis.omega) @ M_Phi.T
    for i, w in enumerate(layer.omega):
        Z = s.K0 + E * s.joints[0].KE + G * s.joints[0].KG + 1j * w * C - w**2 * s.M
        x = np.linalg.solve(Z, deflection(s, 0.05))
        expected = [-(w**2) * (deflection(s, place) @ x) for place in (0.30, 0.42)]
        np.testing.assert_allclose(H[i], expected, rtol=1e-6)
