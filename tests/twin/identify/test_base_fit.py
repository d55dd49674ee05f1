"""A joint's law that was put in comes back: by harmonic balance of the bench, and by a dense structure with noise."""

from dataclasses import dataclass, replace

import numpy as np
import pytest
from circular_noise import circular
from scipy.stats import chi2

from twin.bench import BenchSetup, open_bench
from twin.identify import base_fit
from twin.identify.base_fit import fit_base, law_from_steps
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.forward import forward_model
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import nominal_parameters
from twin.identify.measured_data import MeasuredData
from twin.identify.nonlinear.joint_law import LayerLaw
from twin.identify.nonlinear.opening_harmonics import balance_openings
from twin.identify.nonlinear.running_amplitude import squares_of
from twin.identify.residuals.error_model import SOUND
from twin.identify.residuals.residual_model import ResidualModel
from twin.joint import Saturating
from twin.response import HarmonicBalance
from twin.rigs import load_rig

STEEL = load_rig("steel-lap-joint")
BAND_Hz = np.geomspace(8.0, 950.0, 80)
SWEPT = {1: (np.linspace(27.4, 25.6, 25), (0.75, 1.5, 3.0, 6.0)), 2: (np.linspace(158.0, 155.0, 25), (0.3, 0.6, 1.0))}
"""Frequencies in Hz and forces in N about each mode."""
HELD_OUT_N = {1: 3.0, 2: 0.6}
SOFTENED = replace(SOUND, steps=replace(SOUND.steps, ratio=3e-4))
"""What the model leaves of one channel against the other where a joint loses two thirds of E': where the evidence of
both modes together is largest.  Sound rigs soften less, and have a sixth of it."""


@pytest.fixture(scope="module")
def nominal():
    return nominal_parameters(STEEL)


def at_rest(build, dense, base, rng=None):
    """Bins of a broadband run that know the linear rig to parts in a thousand."""
    covariance = np.broadcast_to(np.eye(2) * 5e-4**2 + 0j, (len(BAND_Hz), 2, 2))
    held = 0.0 if rng is None else wrong_stiffness(rng, dense, SOUND.broadband, len(BAND_Hz))
    data = build.bins(BAND_Hz, dense.accelerance(2 * np.pi * BAND_Hz, base, held=held), covariance)
    if rng is None:
        return data
    own = circular(rng, 5e-4, data.H.shape) + data.depth * circular(rng, SOUND.broadband.ratio, data.H.shape)
    return replace(data, H=data.H * np.exp(own))


def _fitted(evidence, **options):
    fit = fit_base(evidence, **options)
    return fit.baseline, fit.solution


def wrong_stiffness(rng, dense, errors, count):
    """Of each mode at each frequency, as a sound rig's model has it."""
    return dense.modal_stiffness(circular(rng, errors.stiffness, (count, LIMITS.damped_modes)))


@dataclass(frozen=True)
class Balanced:
    """Sweeps of the bench's own model about two modes: mode and force of each step, and what its points truly do."""

    evidence: MeasuredData
    mode: np.ndarray
    force_N: np.ndarray
    opening: np.ndarray
    slip: np.ndarray
    normal_modulus: np.ndarray
    loss: np.ndarray

    def of(self, keep):
        """Measured data of some of the steps, and of the broadband run."""
        return replace(self.evidence, steps=self.evidence.steps.select(keep))

    def misfit(self, baseline):
        """Relative error of each step's response (s,), at the motion that was measured: the worse of both sensors."""
        residual_model, steps = ResidualModel(self.evidence), self.evidence.steps
        R, omega, _ = residual_model.step_receptance(baseline, inner=False)
        return np.max(
            np.abs(residual_model.responses(R, omega) * steps.force[:, :1] / steps.response[:, :, 0] - 1), axis=1
        )


@pytest.fixture(scope="module")
def balanced(build, steel_model, steel_dense, nominal):
    """By harmonic balance; the joint is driven by its force, whose harmonics are none."""
    bench = open_bench(STEEL, setup=BenchSetup(drive="force", noise=False, converter=False, layout=STEEL.layout()))
    at = [[channel.name for channel in bench.channels].index(name) for name in ("force", "acc1", "acc2")]
    balance = HarmonicBalance(bench.built, harmonics=7)
    found = [
        (mode, level, s) for mode, (Hz, levels) in SWEPT.items() for level in levels for s in balance.sweep(Hz, level)
    ]
    mode, force_N = (np.array([entry[i] for entry in found]) for i in (0, 1))
    solutions = [entry[2] for entry in found]
    omega = 2 * np.pi * np.array([s.frequency_Hz for s in solutions])
    channels = np.array([s.channels[at, 1:8] for s in solutions])
    steps = build.steps(omega, channels[:, 0], channels[:, 1:], relative=2e-5)
    # Three openings, then three slip velocities; each has 15 coefficients.
    local = np.array([np.hypot(*s.unknowns.reshape(6, 15)[:, 1:3].T) for s in solutions])
    opening, slip = local[:, :3], local[:, 3:] / omega[:, None]
    law = bench.built.laws[0]
    return Balanced(
        build.evidence(steel_model, steps, [at_rest(build, steel_dense, nominal)]), mode, force_N, opening, slip,
        nominal.E + law.normal.describing_function(opening).real, law.loss.modulus(slip),
    )  # fmt: skip


def fitted(evidence):
    """Free, then without what a rig file has no place for, as `twin identify` does it."""
    free, solution = _fitted(evidence, errors=SOFTENED)
    elsewhere = np.r_[free.blocks["loss_E"], free.blocks["frequency_discrepancy"]]
    baseline, held = _fitted(evidence, start=free, errors=SOFTENED, held_at_zero=elsewhere)
    assert np.abs(baseline.vector[elsewhere]).max() < base_fit.HELD_PRECISION**-0.5
    assert held.chi2 < 1.5 * solution.chi2 < len(solution.residual)
    return baseline


def test_the_benchs_law_comes_back_from_two_modes_at_once(balanced):
    """Another code, another mesh, all harmonics; one law for both modes, and a force about each that was left out.

    E' falls to less than a third, and the loss grows to more than ten times G'.
    """
    left_out = balanced.force_N == np.vectorize(HELD_OUT_N.get)(balanced.mode)
    baseline = fitted(balanced.of(~left_out))
    E = baseline.base.E - baseline.laws[0].softening_at(balanced.opening)
    loss, true = baseline.laws[0].loss_at(balanced.slip), balanced.loss
    assert balanced.normal_modulus.min() < 0.3 * balanced.normal_modulus.max()
    assert true.max() > 10 * baseline.base.G
    assert np.max(np.abs(E - balanced.normal_modulus)) < 0.006 * balanced.normal_modulus.max()
    # A point that slips little hardly damps: what counts is the energy that is lost.
    energy = true * balanced.slip**2
    assert np.max(np.abs(loss * balanced.slip**2 - energy)) < 0.005 * energy.max()
    large = true > 0.1 * true.max()
    np.testing.assert_allclose(loss[large], true[large], rtol=0.01)
    misfit = balanced.misfit(baseline)
    for mode, level in HELD_OUT_N.items():
        here = (balanced.mode == mode) & (balanced.force_N == level)
        assert np.sqrt(np.mean(misfit[here] ** 2)) < 1e-3
        assert np.max(misfit[here]) < 3e-3


def test_the_law_of_mode_1_is_that_of_mode_2(balanced):
    """Identified from mode 1 alone; mode 2 opens and slips the same points, otherwise shared out, and no farther."""
    of_mode_1 = balanced.mode == 1
    misfit = balanced.misfit(fitted(balanced.of(of_mode_1)))
    for moved in (balanced.opening, balanced.slip):
        assert moved[~of_mode_1].max() < moved[of_mode_1].max()
    assert np.max(misfit[~of_mode_1]) < 8e-3
    assert np.sqrt(np.mean(misfit[~of_mode_1] ** 2)) < 2e-3
    assert np.max(misfit[of_mode_1]) < 2e-3


SOFTENING = Saturating(2.8e8, 4e-7, -2.8e8)


def true_law():
    """Softening and loss of the dense structure's points, as splines fine enough to be the functions themselves."""
    opening, slip = np.geomspace(1e-9, 1e-5, 200), np.geomspace(1e-9, 1e-5, 200)
    return LayerLaw(opening, slip, -SOFTENING.describing_function(opening).real, 3e8 * (slip / 1e-6) ** 1.5)


def test_what_harmonics_add_belongs_to_the_motion_that_it_leads_to(balanced, nominal):
    """Anew from the balance that was found, with receptances that hold its own secant stiffness."""
    baseline, residual_model = BaselineParameters(nominal, (true_law(),)), ResidualModel(balanced.evidence)
    found = residual_model.step_receptance(baseline, inner=False)[2]
    again = balance_openings(baseline.laws, residual_model.openings(baseline, found)).more
    size = np.max(np.abs(found.more))
    assert size > 1e-3 * np.max(np.abs(found.stiffness[:, :3]))
    np.testing.assert_allclose(found.more[:, :3], again, atol=1e-3 * size)


def test_what_harmonics_add_follows_all_that_they_meet(balanced, nominal):
    """The third harmonic of a sweep about mode 2 comes near a resonance; differences of the balance itself say so, too.

    The fundamentals are held, and so is the law's secant stiffness but for the loss, which the slips' harmonics set.
    """
    baseline, residual_model = BaselineParameters(nominal, (true_law(),)), ResidualModel(balanced.evidence)
    held = residual_model.linearisation(baseline)
    secant = np.abs(held.balance.motion)
    omega = residual_model.step_receptance(baseline, inner=False)[1]

    def more(x):
        moved, squares = baseline.with_vector(x), held.balance.added.squares
        direct = by_law = residual_model.local.stiffness(moved.laws, secant, omega.real, squares)[0]
        for _ in range(25):
            openings = residual_model.openings(moved, replace(held.balance, stiffness=by_law + held.balance.more))
            balance = balance_openings(moved.laws, openings)
            squares = squares_of(openings.slips(balance), openings.orders)
            by_law = residual_model.local.stiffness(moved.laws, secant, omega.real, squares)[0]
        return np.concatenate([balance.more, (by_law - direct)[:, 3:]], axis=1)

    blocks, vector = baseline.blocks, baseline.vector
    first = {name: blocks[name].start for name in ("log_E", "log_zeta", "frequency_discrepancy")}
    laws = {"loss": baseline.loss(0).start + 100, "softening": baseline.softening(0).start + 100}
    for name, number in {
        **first,
        "damping": first["log_zeta"] + 2,
        "shift": first["frequency_discrepancy"] + 3,
        **laws,
    }.items():
        step = 1e-4 * max(abs(vector[number]), 1e-2) * np.eye(len(vector))[number]
        expected = (more(vector + step) - more(vector - step)) / (2 * step[number])
        error = np.max(np.abs(held.by_unknowns[:, :, number] - expected))
        assert error < 1e-3 * np.max(np.abs(expected)), (name, error, np.max(np.abs(expected)))


@dataclass(frozen=True)
class Swept:
    """Measured data, and the truth behind it."""

    evidence: MeasuredData
    base: object
    motion: np.ndarray

    def pulls(self, baseline, solution, opening, slip):
        """Errors of E' at openings and of the loss at slips in units of their stated deviations, (2, x)."""
        law, base = baseline.laws[0], baseline.base
        B, C = law.softening_basis(opening), law.loss_basis(slip)
        by = np.zeros((2, len(opening), len(baseline.vector)))
        by[0, :, 0], by[0, :, baseline.softening(0)] = base.E, -B
        by[1, :, baseline.loss(0)] = C
        true = true_law()
        error = [
            base.E - B @ law.softening - (self.base.E - true.softening_at(opening)),
            C @ law.loss - true.loss_at(slip),
        ]
        return np.array(error) / np.sqrt(np.einsum("mxi,ij,mxj->mx", by, solution.covariance, by))


@pytest.fixture
def swept(build, steel_model, steel_dense, nominal, monkeypatch):
    """Makes evidence of a dense structure with that law at its points; exact, or with errors as stated.

    Its layer has no harmonics of its own, here or in the fit.
    """
    monkeypatch.setattr(forward_model, "HARMONIC_TURNS", 0)
    usual = replace(nominal, E=1.06 * nominal.E, G=0.95 * nominal.G, zeta=nominal.zeta * 1.2)
    omega = np.tile(2 * np.pi * np.linspace(25.7, 27.1, 25), 3)
    tip = np.repeat([4e-4, 1e-3, 2.4e-3], 25) * (0.15 + 0.85 / (1 + ((omega / (2 * np.pi) - 26.4) / 0.35) ** 2))

    def make(rng=None, *, base=usual, law=None):
        law = law or true_law()
        held = 0.0 if rng is None else wrong_stiffness(rng, steel_dense, SOUND.steps, 75)
        H, motion = steel_dense.with_law(omega, tip, base, law, held)
        force = tip * omega**2 / np.abs(H[:, 1])
        response = H * force[:, None]
        if rng is not None:
            own = circular(rng, np.hypot(SOUND.steps.ratio, 1e-3), (75, 2))
            response, force = response * np.exp(own), force * np.exp(circular(rng, 1e-3, 75))
        steps = build.steps(omega, force[:, None], response[:, :, None], relative=1e-3)
        evidence = build.evidence(steel_model, steps, [at_rest(build, steel_dense, base, rng)])
        return Swept(evidence, base, np.abs(motion))

    return make


def test_the_law_read_off_the_steps_is_near_enough_to_begin_from(swept):
    """One softening and one loss for each step, as if all points had them; it stays within what a layer can be."""
    data = swept()
    found, true = law_from_steps(ResidualModel(data.evidence), data.base).laws[0], true_law()
    opening, slip = data.motion[:, :3].max(axis=1), data.motion[:, 3:].max(axis=1)
    s, loss = true.softening_at(opening), true.loss_at(slip)
    assert np.max(np.abs(found.softening_at(opening) - s)) < 0.02 * np.max(s)
    assert np.max(np.abs(found.loss_at(slip) - loss)) < 0.03 * np.max(loss)


def test_exact_evidence_leaves_nothing_and_returns_law_and_moduli(swept):
    data = swept()
    baseline, solution = _fitted(data.evidence)
    opening, slip = (np.geomspace(0.05, 1, 30) * data.motion[:, part].max() for part in (slice(3), slice(3, 6)))
    true = true_law()
    E, loss = baseline.base.E - baseline.laws[0].softening_at(opening), baseline.laws[0].loss_at(slip)
    assert solution.chi2 < 0.01 * len(solution.residual)
    assert np.max(np.abs(data.pulls(baseline, solution, opening, slip))) < 1
    np.testing.assert_allclose(E, data.base.E - true.softening_at(opening), rtol=0.005)
    assert np.max(np.abs(loss - true.loss_at(slip))) < 0.01 * np.max(true.loss_at(slip))
    assert baseline.base.zeta[0] == pytest.approx(data.base.zeta[0], rel=0.02)


def test_stated_deviations_of_moduli_and_law_cover_their_errors(swept):
    """What only the prior knows, the frequency discrepancies, is drawn from it."""
    usual = swept().base
    rng = np.random.default_rng(17)
    pulls, misfit = [], []
    for _ in range(6):
        data = swept(rng, base=replace(usual, frequency_discrepancy=LIMITS.frequency_std * rng.standard_normal(5)))
        baseline, solution = _fitted(data.evidence)
        opening, slip = (np.array([0.12, 0.35, 0.65, 0.95]) * data.motion[:, p].max() for p in (slice(3), slice(3, 6)))
        pulls.append(data.pulls(baseline, solution, opening, slip))
        # What the fit took up: the data's part of the information.
        taken = np.trace(np.linalg.solve(solution.information, solution.jacobian.T @ solution.jacobian))
        misfit.append((solution.chi2, len(solution.residual) - taken))
    # Errors at neighbouring amplitudes go together: half as many of them as there are numbers count.
    for mean in np.mean(np.square(pulls), axis=(0, 2)):
        assert chi2.ppf(0.001, 12) / 12 < mean < chi2.ppf(0.999, 12) / 12
    total, freedom = np.sum(misfit, axis=0)
    assert total / freedom == pytest.approx(1.0, abs=4 * np.sqrt(2 / freedom))


def test_a_layer_gives_no_energy_away_whatever_the_noise(swept):
    """Of a linear joint, whose fitted loss would else be negative at half of the slips."""
    nothing = np.array([1e-9, 1e-5])
    linear = LayerLaw.zero(nothing, nothing)
    data = swept(np.random.default_rng(5), law=linear)
    baseline, solution = _fitted(data.evidence)
    assert np.all(baseline.laws[0].loss >= 0.0)
    std = np.sqrt(np.diag(solution.covariance)[baseline.softening(0)])
    assert np.all(np.abs(baseline.laws[0].softening) < 4 * std)
    assert np.min(baseline.laws[0].softening) < 0, "softening may be either way"


def test_a_layer_keeps_some_stiffness_whatever_the_data_ask_for(swept, monkeypatch):
    """They ask for more than half of E'."""
    monkeypatch.setattr(base_fit, "MOST_SOFTENED", 0.3)
    data = swept()
    baseline, _ = _fitted(data.evidence)
    assert np.max(true_law().softening_at(data.motion[:, :3])) > 0.5 * data.base.E
    # The limit counts from the E' at which the last fit began.
    assert 0.29 < np.max(baseline.laws[0].softening) / baseline.base.E < 0.36


def test_a_channel_that_lies_does_not_lead_the_moduli_astray(swept, monkeypatch):
    """A delay, which nothing in the base family makes: smaller errors of the model would have moduli make up for it."""
    data = swept()
    (run,) = data.evidence.broadband
    late = np.stack([np.ones(len(run.omega)), np.exp(-1e-4j * run.omega)], axis=1)
    evidence = replace(data.evidence, broadband=(replace(run, H=run.H * late),))
    astray = []
    for limit in (LIMITS.base_fit_followed, np.inf):
        monkeypatch.setattr(base_fit, "LIMITS", replace(LIMITS, base_fit_followed=limit))
        baseline, _ = _fitted(evidence)
        astray.append(np.abs(np.log(np.concatenate([baseline.base.E / data.base.E, baseline.base.G / data.base.G]))))
    assert np.max(astray[0]) < 0.1 < np.max(astray[1]), astray
