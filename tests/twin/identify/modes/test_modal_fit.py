"""Modes from frequency responses alone: the poles of a sum of modes come back through noise, with honest intervals."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from beam_rows import deflection
from needed import package

from twin.identify.modes import fit_modes
from twin.identify.modes.refinement import refine_poles
from twin.rigs import load_rig
from twin.structure import assemble, normal_modes

STEEL_DAMPING = np.array([0.0023, 0.002, 0.002, 0.003, 0.003] + 7 * [0.003])


def summed(frequency_Hz, natural_Hz, damping, shapes):
    """Accelerances of modes: shapes (o, m) are products of the modes at sensor and force."""
    w, W = 2 * np.pi * frequency_Hz[:, None], 2 * np.pi * np.asarray(natural_Hz)
    return -(w**2) * ((1 / (W**2 - w**2 + 2j * np.asarray(damping) * W * w)) @ shapes.T)


def noisy(H, seed, noise=0.01):
    """With errors of `noise` times each response and its channel's median.

    At twice the noise the information itself ends near 1.1 % of mode 4's damping: one in 200 dampings strays by 3 %.
    """
    generator = np.random.default_rng(seed)
    std = noise * (np.abs(H) + np.median(np.abs(H), axis=0))
    error = generator.standard_normal(H.shape) + 1j * generator.standard_normal(H.shape)
    return H + std * error / np.sqrt(2), std


@pytest.fixture(scope="module")
def steel():
    """The steel rig's lines (closer together about mode 1), natural frequencies in band, and responses."""
    s = assemble(load_rig("steel-lap-joint"))
    modes = normal_modes(s.M, s.stiffness(3.9e8, 7.6e7), 12)
    f = np.concatenate([np.arange(5.0, 40.0, 1 / 16), np.arange(40.0, 1000.0, 0.25)])
    rows = np.array([deflection(s, 0.30), deflection(s, 0.42)]) @ modes.Phi
    H = summed(f, modes.frequency_Hz, STEEL_DAMPING, rows * (deflection(s, 0.05) @ modes.Phi))
    return f, modes.frequency_Hz[:4], H


def check_steel(steel, seed):
    f, natural_Hz, H = steel
    data, std = noisy(H, seed)
    fit = fit_modes(f, data, std)
    assert len(fit.modes) == 4, "every mode in band, and no other"
    frequency, damping = (np.array([getattr(m, n) for m in fit.modes]) for n in ("frequency_Hz", "damping_ratio"))
    np.testing.assert_allclose(frequency, natural_Hz, rtol=5e-4)
    np.testing.assert_allclose(damping, STEEL_DAMPING[:4], rtol=0.03)
    z = [(m.frequency_Hz - t) / m.frequency_std_Hz for m, t in zip(fit.modes, natural_Hz, strict=True)]
    return [*z, *((m.damping_ratio - t) / m.damping_std for m, t in zip(fit.modes, STEEL_DAMPING, strict=False))]


@pytest.mark.parametrize("seed", range(2))
def test_the_steel_rigs_modes_come_back_through_noise(steel, seed):
    assert np.max(np.abs(check_steel(steel, seed))) < 4.5, "in units of their standard deviations"


@pytest.mark.slow
def test_fifty_seeds_of_the_steel_rigs_modes(steel):
    z = np.array([check_steel(steel, seed) for seed in range(50)])
    assert np.mean(np.abs(z) < 1.96) > 0.9


def test_close_modes_are_told_apart_where_the_noise_is_not_given():
    natural_Hz, damping = [30.0, 95.0, 97.0, 180.0, 240.0], [0.01, 0.006, 0.008, 0.02, 0.004]
    shapes = np.random.default_rng(99).uniform(0.3, 1.0, (3, 5)) * np.array([[1], [-1], [1]])
    f = np.arange(10.0, 300.0, 0.25)
    data, _ = noisy(summed(f, natural_Hz, damping, shapes), 1, noise=0.01)
    fit = fit_modes(f, data)
    np.testing.assert_allclose([m.frequency_Hz for m in fit.modes], natural_Hz, rtol=5e-4)
    np.testing.assert_allclose([m.damping_ratio for m in fit.modes], damping, rtol=0.03)
    for mode, true in zip(fit.modes, damping, strict=True):
        assert abs(mode.damping_ratio - true) < 4.5 * mode.damping_std
    assert 0.8 < fit.chi2_per_dof < 1.3


def test_an_independent_program_agrees():
    """sdypy-EMA's least-squares complex frequency fit of the same lines, at the poles nearest to ours."""
    ema = package("sdypy.EMA")
    natural_Hz, damping = np.array([60.0, 150.0, 240.0]), np.array([0.01, 0.006, 0.004])
    f = np.arange(1.0, 300.0, 0.25)
    shapes = np.random.default_rng(3).uniform(0.5, 1.0, (2, 3))
    data, std = noisy(summed(f, natural_Hz, damping, shapes), 5, noise=1e-3)
    ours = fit_modes(f, data, std)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        other = ema.Model(frf=data.T, freq=f, lower=10, upper=300, pol_order_high=20, frf_type="accelerance")
        other.get_poles(show_progress=False)
        other.select_closest_poles(list(natural_Hz))
    np.testing.assert_allclose([m.frequency_Hz for m in ours.modes], other.nat_freq, rtol=2e-4)
    np.testing.assert_allclose([m.damping_ratio for m in ours.modes], other.nat_xi, rtol=0.03)


def test_noise_alone_has_no_modes_worth_their_parameters():
    generator = np.random.default_rng(2)
    f = np.arange(10.0, 200.0, 0.25)
    H = 1.0 + 0.1 * (generator.standard_normal((len(f), 2)) + 1j * generator.standard_normal((len(f), 2)))
    try:
        fit = fit_modes(f, H)
    except ValueError:
        return
    assert len(fit.modes) <= 1


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        (lambda f, H: (f[:10], H[:10]), "at least 20 lines"),
        (lambda f, H: (f[::-1], H), "must rise"),
        (lambda f, H: (f - 10.0, H), "above zero"),
        (lambda f, H: (f, H * np.nan), "not finite"),
    ],
)
def test_lines_that_cannot_be_fitted_are_refused(change, reason):
    f = np.arange(10.0, 100.0)
    with pytest.raises(ValueError, match=reason):
        fit_modes(*change(f, np.ones((len(f), 1), complex)))


def test_beyond_its_band_a_fit_keeps_the_remainders_of_its_ends():
    """They go by 1 / omega^2 and omega^2, and a reference that goes up so outside says that noise there is clear."""
    frequency_Hz = np.linspace(20.0, 200.0, 700)
    H, std = noisy(summed(frequency_Hz, [60.0, 110.0], [0.002, 0.003], np.array([[1.0, 0.5], [0.4, -0.8]])), 3)
    fit = fit_modes(frequency_Hz, H + 0.05 * (20.0 / frequency_Hz[:, None]) ** 2, std).fit
    ends, beyond = (fit.responses(2 * np.pi * np.array(at)) for at in ([20.0, 200.0], [2.0, 2000.0]))
    modes = [np.sum(fit.parts(2 * np.pi * np.array(at)), axis=2) for at in ([20.0, 200.0], [2.0, 2000.0])]
    np.testing.assert_allclose(beyond - modes[1], ends - modes[0], rtol=1e-9)
    assert np.max(np.abs(ends[0] - modes[0][0])) > 0.03


@pytest.mark.parametrize("start", [(425.0, 0.12), (4e5, 50.0), (0.01, 0.5)])
def test_a_pole_that_wanders_from_all_lines_stays_one_that_swings_and_is_what_was_fitted(start):
    """Begun just beyond the band it may go on for ever: nothing but a remainder is left of it."""
    f = np.linspace(5.0, 410.0, 1200)
    natural, damping = np.array([21.0, 78.0, 266.0]), np.array([0.008, 0.005, 0.02])
    H, std = noisy(summed(f, natural, damping, np.array([[2.0, 1.0, 5.0]])), 7)
    weight = np.sqrt(2) / std
    poles = np.vstack([np.column_stack([natural, damping]), start]).T
    fit = refine_poles(f, H, weight, omega=2 * np.pi * poles[0], zeta=poles[1])
    assert np.all(fit.zeta < 1)
    assert np.all(fit.omega < 1.01e2 * 2 * np.pi * f[-1])
    left = weight * (H - fit.responses(2 * np.pi * f))
    assert np.sum(np.abs(left) ** 2) == pytest.approx(fit.chi2, rel=1e-3)
