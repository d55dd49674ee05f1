"""A dense structure's sweeps and broadband run, without noise."""

from dataclasses import replace

import numpy as np
import pytest
from swept import SWEPT, BAND_Hz

from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward import forward_model
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.residuals import residual_model
from twin.rigs import load_rig

OPENING, SLIP = np.geomspace(5e-8, 8e-6, 6), np.geomspace(2e-8, 2e-6, 7)


@pytest.fixture(scope="module")
def baseline():
    """A softening, losing joint, base parameters away from what is assumed."""
    base = nominal_parameters(load_rig("steel-lap-joint"))
    E, G = base.E, base.G
    base = replace(base, E=1.05 * E, G=0.95 * G, loss_E=0.01, loss_G=0.02, frequency_discrepancy=np.full(5, 1e-4))
    law = LayerLaw(OPENING, SLIP, E * np.linspace(0.02, 0.5, 6), G * np.linspace(0.1, 6.0, 7) ** 1.2)
    return BaselineParameters(base, (law,))


@pytest.fixture
def fundamentals_alone(monkeypatch):
    """The layer has no harmonics of its own, in the dense structure as in the model, but where a test lets it."""
    monkeypatch.setattr(forward_model, "HARMONIC_TURNS", 0)
    monkeypatch.setattr(residual_model, "harmonics_by_unknowns", lambda *given: (None, None))


@pytest.fixture(scope="module")
def swept(steel_dense, baseline):
    """Frequencies of two sweeps, accelerances and the tip's amplitudes there, and the motion of the layer's points."""
    omega = np.tile(SWEPT, 2)
    tip = np.repeat([9e-4, 2.2e-3], len(SWEPT)) * (0.2 + 0.8 / (1 + ((omega / (2 * np.pi) - 26.4) / 0.3) ** 2))
    H, motion = steel_dense.with_law(omega, tip, baseline.base, baseline.laws[0])
    return omega, tip, H, motion


@pytest.fixture(scope="module")
def evidence(build, steel_model, steel_dense, baseline, swept):
    """Two sweeps and a broadband run without any noise, of a dense structure with the unknowns' law."""
    omega, tip, H, _ = swept
    force = (tip * omega**2 / np.abs(H[:, 1]))[:, None] * np.exp(0.3j)
    response = np.zeros((len(omega), 2, 7), complex)
    response[:, :, 0] = H * force
    response[:, :, 2] = 0.01 * response[:, :, 0] * np.array([0.7, 1.0])
    forces = np.concatenate([force, -0.01 * force, 0.02j * force], axis=1)
    steps = build.steps(omega, forces, response)
    rng = np.random.default_rng(2)
    spread = 1e-3 * rng.uniform(1, 3, (len(BAND_Hz), 2))
    covariance = spread[:, :, None] ** 2 * np.eye(2) + 2e-6 + 0j
    at_rest = steel_dense.accelerance(2 * np.pi * BAND_Hz, baseline.base)
    return build.evidence(steel_model, steps, [build.bins(BAND_Hz, at_rest, covariance)])
