"""What the layer itself does beside a resonance, against modes and responses of the dense structure."""

from dataclasses import replace

import numpy as np
import pytest

from studies.layer_motion import layer_motion
from studies.layer_response import layer_response
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.residuals.residual_model import ResidualModel
from twin.rigs import load_rig

OMEGA = 2 * np.pi * np.array([25.5, 26.2, 26.6, 27.0, 28.0])
SOFTENING, LOSS = np.array([0.0, 5e7, 1.5e8, 5e7, 1e7]), np.array([0.0, 3e7, 2e8, 3e7, 1e7])


@pytest.fixture(scope="module")
def shares(build, steel_model, steel_dense):
    """By products of receptances, and by the dense structure, (2, 5) each."""
    base = replace(nominal_parameters(load_rig("steel-lap-joint")), E=3.6e8)
    ones = np.ones((len(OMEGA), 1), complex)
    steps = build.steps(OMEGA, ones, np.ones((len(OMEGA), 2, 1), complex))
    residual_model = ResidualModel(build.evidence(steel_model, steps))
    dE, dG = -SOFTENING + 0j, 1j * LOSS

    def layer_at(omega):
        return layer_response(residual_model, base, omega, np.zeros(len(omega)))

    found = layer_motion(layer_at(OMEGA), layer_at, OMEGA, dE, dG, output=1)
    return np.array([found.opening, found.slip]), steel_dense.layer_shares(OMEGA, base, dE, dG)


def test_shares_are_those_of_the_dense_structure(shares):
    found, dense = shares
    np.testing.assert_allclose(found, dense, atol=2e-5)


def test_the_drive_moves_the_layer_otherwise_than_the_mode_does(shares):
    """By some parts in a thousand within a few per cent of the resonance: more than a law is known to."""
    _, dense = shares
    assert 2e-3 < np.max(np.abs(dense - 1)) < 2e-2
