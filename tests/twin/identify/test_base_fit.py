"""A joint's law that was put in comes back: by harmonic balance of the bench, and by a dense structure with noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2

from twin.bench import open_bench
from twin.identify.base_fit import fit_base, starting_unknowns, stepwise_law
from twin.identify.joint_law import SplineLaw, choose_knots
from twin.identify.linear_fit import DETUNING_STD
from twin.identify.linear_model import believed_parameters
from twin.identify.prediction import SHARE_STD, Predictor
from twin.identify.unknowns import Unknowns
from twin.identify.whitening import COMMON_ERROR, LAW_ERROR, RATIO_ERROR
from twin.joint import Saturating
from twin.response import HarmonicBalance
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
BAND_Hz = np.geomspace(8.0, 950.0, 80)
SOFTENING, LOSS_AT_1_mm = Saturating(2.4e8, 9e-4, -2.4e8), 3e7


@pytest.fixture(scope="module")
def believed():
    return believed_parameters(STEEL)


def at_rest(build, dense, base, rng=None):
    """Bins of a broadband run that know the linear rig to parts in a thousand."""
    covariance = np.broadcast_to(np.eye(2) * 5e-4**2 + 0j, (len(BAND_Hz), 2, 2))
    data = build.bins(BAND_Hz, dense.accelerance(2 * np.pi * BAND_Hz, base), covariance)
    if rng is None:
        return data
    own = circular(rng, 5e-4, data.H.shape) + data.depth * circular(rng, RATIO_ERROR, data.H.shape)
    return replace(data, H=data.H * np.exp(own + circular(rng, COMMON_ERROR, (len(BAND_Hz), 1))))


@pytest.fixture(scope="module")
def balanced(build, steel_model, steel_dense, believed):
    """Sweeps of the bench's own model at four forces by harmonic balance; the joint's true moduli at each step."""
    bench = open_bench(STEEL, drive="force", noise=False, converter=False, beam_elements=41, layer_elements=3)
    at = [[channel.name for channel in bench.channels].index(name) for name in ("force", "acc1", "acc2")]
    balance = HarmonicBalance(bench.built, harmonics=7)
    solutions = [s for level in (0.75, 1.5, 3.0, 6.0) for s in balance.sweep(np.linspace(27.4, 25.4, 33), level)]
    omega = 2 * np.pi * np.array([s.frequency_Hz for s in solutions])
    channels = np.array([s.channels[at, 1:8] for s in solutions])
    steps = build.steps(omega, channels[:, 0], channels[:, 1:], relative=2e-5)
    # The local coordinates are the opening and the slip's velocity; each has 15 coefficients.
    opening = np.array([np.hypot(*s.unknowns[1:3]) for s in solutions])
    slip = np.array([np.hypot(*s.unknowns[16:18]) for s in solutions]) / omega
    law = bench.built.law
    true_E, true_loss = believed.E + law.normal.stiffness(opening).real, law.loss.modulus(slip)
    return build.evidence(steel_model, steps, [at_rest(build, steel_dense, believed)]), true_E, true_loss


def test_the_benchs_law_comes_back_from_harmonic_balance(balanced):
    """Another code, another mesh of the layer's forces, all harmonics: E' falls by half and the loss grows to 11 G'.

    What a rig file has no place for is held at nothing: a share of the loss in the opening explains the same steps.
    """
    evidence, true_E, true_loss = balanced
    free, solution = fit_base(evidence)
    names, last = free.base.names, len(free.vector)
    elsewhere = [n for n, name in enumerate(names) if name == "loss_E" or name.startswith("detuning")]
    unknowns, held = fit_base(evidence, start=free, held_at_zero=[*elsewhere, last - 2, last - 1])
    X = evidence.steps.amplitude_m
    E = unknowns.base.E - unknowns.law.softening_at(X)
    assert true_E.min() < 0.5 * true_E.max()
    assert np.sqrt(np.mean((E / true_E - 1) ** 2)) < 0.01
    assert np.max(np.abs(E - true_E)) < 0.02 * true_E.max()
    large = X > 7e-4
    np.testing.assert_allclose(unknowns.law.loss_at(X[large]), true_loss[large], rtol=0.05)
    assert true_loss.max() > 10 * unknowns.base.G
    assert abs(free.softening_in_shear) < 0.05
    assert held.chi2 < 1.5 * solution.chi2 < len(solution.residual)


def law_at(X):
    """Softening and loss."""
    return -SOFTENING.stiffness(X).real, LOSS_AT_1_mm * (X / 1e-3) ** 1.5


@pytest.fixture(scope="module")
def swept(build, steel_model, steel_dense, believed):
    """Makes evidence of a dense structure with that law, shared out as asked; exact, or with errors as stated."""
    usual = replace(believed, E=1.06 * believed.E, G=0.95 * believed.G, zeta=believed.zeta * 1.2)
    reference_omega = float(steel_model.basis.omega[0])
    omega = np.tile(2 * np.pi * np.linspace(25.7, 27.1, 29), 3)
    X = np.repeat([4e-4, 1e-3, 2.4e-3], 29) * (0.15 + 0.85 / (1 + ((omega / (2 * np.pi) - 26.4) / 0.35) ** 2))
    blank = build.steps(omega, np.ones((87, 1)), np.ones((87, 2, 1)))
    q = Predictor(build.evidence(steel_model, blank)).shear_share

    def make(rng=None, *, in_shear=0.0, in_normal=0.0, base=usual):
        s, loss = law_at(X)
        if rng is not None:
            s, loss = s * (1 + LAW_ERROR * rng.standard_normal(87)), loss * (1 + LAW_ERROR * rng.standard_normal(87))
        dE = -(1 - in_shear) * s + 1j * in_normal * q * loss
        dG = -in_shear / q * s + 1j * (1 - in_normal) * loss
        H = steel_dense.accelerance(omega, base, dE, dG)
        force = X * reference_omega**2 / np.abs(H[:, 1])
        response = H * force[:, None]
        if rng is not None:
            own, shared = circular(rng, np.hypot(RATIO_ERROR, 1e-3), (87, 2)), circular(rng, COMMON_ERROR, (87, 1))
            response, force = response * np.exp(own + shared), force * np.exp(circular(rng, 1e-3, 87))
        steps = build.steps(omega, force[:, None], response[:, :, None], relative=1e-3)
        return build.evidence(steel_model, steps, [at_rest(build, steel_dense, base, rng)])

    return usual, make


def circular(rng, size, shape):
    """Complex normal variables with E|z|^2 = size^2."""
    return size / np.sqrt(2) * (rng.standard_normal(shape) + 1j * rng.standard_normal(shape))


def test_step_by_step_the_law_is_read_off_exactly(swept):
    """Two real numbers from each complex response, where softening is in E' and loss in G' alone."""
    base, make = swept
    evidence = make()
    X = evidence.steps.amplitude_m
    found = stepwise_law(Predictor(evidence), Unknowns(base, SplineLaw.zero(choose_knots(X, 20)))).law
    s, loss = law_at(X)
    assert np.max(np.abs(found.softening_at(X) - s)) < 0.002 * np.max(s)
    assert np.max(np.abs(found.loss_at(X) - loss)) < 0.002 * np.max(loss)


def pulls_at(X, base, unknowns, solution):
    """Errors of E' and of the loss at amplitudes X in units of their stated deviations, (2, x)."""
    n, k = len(unknowns.base.vector), len(unknowns.law.knots)
    B = unknowns.law.basis(X)
    by = np.zeros((2, len(X), len(unknowns.vector)))
    by[0, :, 0], by[0, :, n : n + k] = unknowns.base.E, -B
    by[1, :, n + k : n + 2 * k] = B
    s, loss = law_at(X)
    error = [unknowns.base.E - B @ unknowns.law.softening - (base.E - s), B @ unknowns.law.loss - loss]
    return np.array(error) / np.sqrt(np.einsum("mxi,ij,mxj->mx", by, solution.covariance, by))


@pytest.mark.parametrize(("in_shear", "in_normal"), [(0.0, 0.0), (0.05, 0.04)])
def test_exact_evidence_leaves_nothing_and_returns_law_and_moduli(swept, in_shear, in_normal):
    """Where the law acts is hardly seen, and the prior draws it to nowhere else: by less than a standard deviation."""
    base, make = swept
    evidence = make(in_shear=in_shear, in_normal=in_normal)
    unknowns, solution = fit_base(evidence)
    X = evidence.steps.amplitude_m
    s, loss = law_at(X)
    assert solution.chi2 < 0.01 * len(solution.residual)
    assert np.max(np.abs(pulls_at(X, base, unknowns, solution))) < 1
    # A share that is taken for none shows in the other's place: as much as itself, and no more.
    np.testing.assert_allclose(unknowns.base.E - unknowns.law.softening_at(X), base.E - s, rtol=0.005 + in_shear)
    assert np.max(np.abs(unknowns.law.loss_at(X) - loss)) < (0.01 + in_shear + in_normal) * np.max(loss)
    assert unknowns.base.zeta[0] == pytest.approx(base.zeta[0], rel=0.02)
    std = np.sqrt(np.diag(solution.covariance)[-2:])
    assert abs(unknowns.softening_in_shear - in_shear) < std[0]
    assert abs(unknowns.loss_in_normal - in_normal) < std[1]


def test_stated_deviations_of_moduli_and_law_cover_their_errors(swept):
    """What only the prior knows, detunings and where the law acts, is drawn from it."""
    usual, make = swept
    rng = np.random.default_rng(17)
    pulls, misfit = [], []
    for _ in range(6):
        base = replace(usual, detuning=DETUNING_STD * rng.standard_normal(5))
        in_shear, in_normal = SHARE_STD * rng.standard_normal(2)
        unknowns, solution = fit_base(make(rng, in_shear=in_shear, in_normal=in_normal, base=base))
        pulls.append(pulls_at(np.array([3e-4, 9e-4, 1.6e-3, 2.3e-3]), base, unknowns, solution))
        # What the fit took up: the data's part of the information.
        fitted = np.trace(np.linalg.solve(solution.information, solution.jacobian.T @ solution.jacobian))
        misfit.append((solution.chi2, len(solution.residual) - fitted))
    # Errors at neighbouring amplitudes go together: half as many of them as there are numbers count.
    for mean in np.mean(np.square(pulls), axis=(0, 2)):
        assert chi2.ppf(0.001, 12) / 12 < mean < chi2.ppf(0.999, 12) / 12
    total, freedom = np.sum(misfit, axis=0)
    assert total / freedom == pytest.approx(1.0, abs=4 * np.sqrt(2 / freedom))


def test_what_is_held_at_zero_stays_there(swept):
    _, make = swept
    evidence = make()
    size = len(starting_unknowns(evidence).vector)
    unknowns, solution = fit_base(evidence, held_at_zero=(size - 2, size - 1))
    assert abs(unknowns.softening_in_shear) < 1e-9
    assert abs(unknowns.loss_in_normal) < 1e-9
    assert np.sqrt(solution.covariance[-1, -1]) < 1e-7
