"""Moduli, losses and damping from frequency responses made by a dense solution, with noise of known covariance."""

from dataclasses import replace

import numpy as np
import pytest
from eigenvalue_sensitivity import eigenvalue_sensitivity
from scipy.stats import chi2

from twin.identify.linear.linear_fit import MODULI_STD, base_bounds, base_prior, fit_linear, whitening
from twin.identify.linear.linear_model import LinearParameters, nominal_parameters
from twin.identify.spectra.broadband import BinnedResponse
from twin.rigs import load_rig
from twin.structure import normal_modes

FREQUENCIES = np.unique(
    np.concatenate([np.geomspace(6, 950, 60), *(f * (1 + np.linspace(-0.02, 0.02, 21)) for f in (26.45, 156.9, 470.7))])
)
DRAWS = 12


@pytest.fixture(scope="module")
def nominal():
    return nominal_parameters(load_rig("steel-lap-joint"))


def covariance(rng):
    """Noise that the channels share and noise of their own, of two parts in a thousand, another one in each bin."""
    own, shared = 2e-3 * rng.uniform(0.5, 2, (len(FREQUENCIES), 2)), 2e-3 * rng.uniform(0.5, 2, len(FREQUENCIES))
    return own[:, :, None] ** 2 * np.eye(2) + shared[:, None, None] ** 2 + 0j


def measured(dense, base, rng, noise=1.0):
    """A binned response of the dense model."""
    C = covariance(rng)
    white = rng.standard_normal((2, *C.shape[:2], 1)) / np.sqrt(2)
    error = noise * (np.linalg.cholesky(C) @ (white[0] + 1j * white[1]))[:, :, 0]
    H = dense.accelerance(2 * np.pi * FREQUENCIES, base)
    return BinnedResponse(
        run="dense", time_s=0.0, frequency_Hz=FREQUENCIES, H=H * np.exp(error),
        relative_covariance=C, channels=("acc1", "acc2"), noise_density={}, distortion=np.ones(len(FREQUENCIES)),
        force_power=np.zeros(len(FREQUENCIES)),
    )  # fmt: skip


def truth(nominal, rng):
    """Drawn from the fit's own prior, so that its posterior should hold it; losses away from their limit."""
    mean, precision = base_prior(nominal)
    # By Cholesky's factor: eigenvectors, and with them the draw, have another sign on another processor.
    vector = rng.multivariate_normal(mean, np.linalg.inv(precision), method="cholesky")
    vector[2:4] = rng.uniform(0.02, 0.05), rng.uniform(0.1, 0.2)
    return LinearParameters.from_vector(vector)


@pytest.fixture(scope="module")
def fits(steel_model, steel_dense, nominal):
    """True parameters and fits to noisy responses."""
    rng = np.random.default_rng(11)
    found = []
    for _ in range(DRAWS):
        base = truth(nominal, rng)
        data = measured(steel_dense, base, rng)
        found.append((base, fit_linear(steel_model, data, nominal, nominal=nominal)))
    return found


def calibrated(pulls):
    """Whether the sum of squares is neither too large nor too small for unit normal variables."""
    return 0.0025 < chi2.cdf(np.sum(np.square(pulls)), np.size(pulls)) < 0.9975


@pytest.mark.parametrize("entry", [0, 1])
def test_moduli_come_back_within_their_stated_deviations(fits, entry):
    std = np.array([np.sqrt(fit.covariance[entry, entry]) for _, fit in fits])
    assert np.max(std) < 0.35 * MODULI_STD
    assert calibrated([fit.base.vector[entry] - base.vector[entry] for base, fit in fits] / std)


def total_damping(model, base):
    """Damping ratios of four modes with the joint's loss by its share of the strain energy, and gradient by vector."""
    s = model.structure
    modes = normal_modes(s.M, s.stiffness(base.E, base.G), 4)
    by_E, by_G = (
        p * eigenvalue_sensitivity(modes.Phi, B) for p, B in ((base.E, s.joints[0].B_E), (base.G, s.joints[0].B_G))
    )
    by_E, by_G = by_E / modes.omega**2 / 2, by_G / modes.omega**2 / 2
    gradient = np.zeros((4, len(base.vector)))
    gradient[:, 2], gradient[:, 3] = by_E, by_G
    gradient[np.arange(4), 4 + np.arange(4)] = base.zeta[:4]
    return base.zeta[:4] + by_E * base.loss_E + by_G * base.loss_G, gradient


def test_the_damping_of_each_mode_comes_back_whatever_part_the_joint_has_in_it(steel_model, fits):
    """Joint loss and modal ratios make up for each other along a curve; their sum is what a resonance shows."""
    pulls = []
    for base, fit in fits:
        (true, _), (found, gradient) = total_damping(steel_model, base), total_damping(steel_model, fit.base)
        std = np.sqrt(np.einsum("mi,ij,mj->m", gradient, fit.covariance, gradient))
        alone = fit.base.zeta[:4] * np.sqrt(np.diag(fit.covariance)[4:8])
        assert np.all(std[:3] < alone[:3] / 3)
        # A peak as sharp as the sharpest drawn one has but a bin or two, with noise of half a per cent each.
        assert np.max(std[:3] / found[:3]) < 1e-2
        pulls.append((found - true) / std)
    assert calibrated(pulls)


def test_losses_of_the_joint_come_back_within_their_stated_deviations(fits):
    pulls = [(fit.base.vector - base.vector)[2:4] / np.sqrt(np.diag(fit.covariance)[2:4]) for base, fit in fits]
    assert calibrated(pulls)


def test_the_misfit_is_that_of_the_noise(fits):
    freedom = 4 * len(FREQUENCIES)
    for _, fit in fits:
        assert fit.chi2_per_dof == pytest.approx(1.0, abs=4 * np.sqrt(2 / freedom))


def test_exact_responses_give_the_exact_moduli(steel_model, steel_dense, nominal):
    """What the prior draws towards itself is far less than its own width."""
    base = replace(nominal, E=1.1 * nominal.E, G=0.93 * nominal.G, loss_E=0.03, loss_G=0.1, zeta=nominal.zeta * 1.5)
    fit = fit_linear(steel_model, measured(steel_dense, base, np.random.default_rng(0), 0.0), nominal, nominal=nominal)
    std = np.sqrt(np.diag(fit.covariance))
    assert np.all(np.abs(fit.base.vector - base.vector)[:9] < 0.5 * std[:9])
    np.testing.assert_allclose([fit.base.E, fit.base.G], [base.E, base.G], rtol=3e-3)


def test_a_rig_that_loses_nothing_in_its_joint_gets_no_negative_loss(steel_model, steel_dense, nominal):
    lower, upper = base_bounds()
    base = replace(nominal, loss_E=0.0, loss_G=0.0)
    for seed in range(4):
        data = measured(steel_dense, base, np.random.default_rng(seed))
        vector = fit_linear(steel_model, data, nominal, nominal=nominal).base.vector
        assert np.all((vector >= lower) & (vector <= upper))


def test_whitened_noise_is_white():
    rng = np.random.default_rng(5)
    C = covariance(rng)
    white = (rng.standard_normal((2, *C.shape[:2], 400)) / np.sqrt(2)).astype(complex)
    noise = np.linalg.cholesky(C) @ (white[0] + 1j * white[1])
    whitened = whitening(C) @ noise
    assert np.mean(np.abs(whitened) ** 2) == pytest.approx(1.0, abs=0.01)
    assert abs(np.mean(whitened[:, 0] * whitened[:, 1].conj())) < 0.01
    np.testing.assert_allclose(whitened, white[0] + 1j * white[1], rtol=1e-9, atol=1e-12)
