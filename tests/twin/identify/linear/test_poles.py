"""Poles found on a response alone: against a sum of residues whose poles are known, and a rig's complex modes."""

import numpy as np
import pytest

from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.linear.poles import poles_near
from twin.rigs import load_rig

POLES = np.array([-0.15 + 165j, -1.8 + 1000j, -2.1 + 1012j, -14.0 + 5500j])
RESIDUES = np.array([[1.0 + 0.2j, -0.4j], [0.3, 2.0], [1.1j, -0.7], [5.0, 0.02]])


def response(omega):
    """Two responses of four modes, what lies beyond, and a high-pass of the first channel."""
    jw = 1j * omega[:, None]
    H = np.sum([r / (jw - p) + np.conj(r) / (jw - np.conj(p)) for r, p in zip(RESIDUES, POLES, strict=True)], axis=0)
    return (H + 1e-3 + 1e-6 * jw) * np.array([1.0, 0.9])


@pytest.mark.parametrize("off", [-4e-3, -1e-4, 0.0, 2e-3])
@pytest.mark.parametrize("damping", [0.3, 1.0, 4.0])
def test_poles_are_found_from_beside(off, damping):
    guesses = POLES.real * damping + 1j * POLES.imag * (1 + off)
    found = poles_near(response, guesses)
    assert np.all(np.abs(found - POLES) < 0.02 * np.abs(POLES.real)), found


def test_a_guess_without_a_peak_stays():
    guesses = np.array([-1.0 + 400j, -1.8 + 1000j])
    found = poles_near(response, guesses)
    assert found[0] == guesses[0]
    assert found[1] != guesses[1]


def test_a_rig_without_joint_loss_has_the_poles_of_its_modes(steel_model):
    base = nominal_parameters(load_rig("steel-lap-joint"))

    def rig(omega):
        return steel_model.response(steel_model.receptance(omega, base, inner=False), omega)

    omega, zeta = steel_model.basis.omega[:5], base.zeta
    poles = omega * (-zeta + 1j * np.sqrt(1 - zeta**2))
    found = poles_near(rig, (-2 * zeta + 1.002j) * omega)
    np.testing.assert_allclose(found.imag, poles.imag, rtol=1e-5)
    np.testing.assert_allclose(found.real, poles.real, rtol=2e-2)
