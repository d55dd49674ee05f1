"""The sine fit against signals whose harmonics are known."""

import numpy as np
import pytest

from twin.procedures.limits import LIMITS
from twin.procedures.sine_fit import fit_sine

RATE, FREQUENCY = 2048.0, 26.45


def signal(count, rng=None, noise=0.0, offset_s=0.0):
    t = np.arange(count) / RATE + offset_s
    x = 0.3 + np.real(2.0 * np.exp(1j * (2 * np.pi * FREQUENCY * t + 0.7)))
    x += np.real(0.05 * np.exp(1j * (6 * np.pi * FREQUENCY * t - 1.1)))
    return x if rng is None else x + noise * rng.normal(size=count)


def test_harmonics_and_mean_are_exact_over_a_broken_cycle():
    fit = fit_sine(signal(801), frequency_Hz=FREQUENCY, sample_rate_Hz=RATE)
    assert fit.phasor == pytest.approx(2.0 * np.exp(0.7j), abs=1e-12)
    assert fit.harmonics[2] == pytest.approx(0.05 * np.exp(-1.1j), abs=1e-12)
    assert fit.mean == pytest.approx(0.3, abs=1e-12)
    assert fit.distortion == pytest.approx(0.025, abs=1e-10)


def test_phase_refers_to_the_moment_named():
    late = fit_sine(signal(800, offset_s=1.234), frequency_Hz=FREQUENCY, sample_rate_Hz=RATE, offset_s=1.234)
    assert late.phasor == pytest.approx(2.0 * np.exp(0.7j), abs=1e-10)


def test_lost_samples_cost_precision_only():
    x = signal(800)
    x[100:350] = np.nan
    assert fit_sine(x, frequency_Hz=FREQUENCY, sample_rate_Hz=RATE).phasor == pytest.approx(
        2.0 * np.exp(0.7j), abs=1e-9
    )


def test_the_stated_deviation_is_the_scatter_of_repeated_fits():
    rng = np.random.default_rng(5)
    fits = [
        fit_sine(signal(800, rng, noise=0.1), frequency_Hz=FREQUENCY, sample_rate_Hz=RATE, modulation=2)
        for _ in range(400)
    ]
    scatter = np.std([fit.phasor.real for fit in fits])
    assert fits[0].std == pytest.approx(scatter, rel=0.15)


def test_a_slow_change_is_not_taken_for_noise():
    t = np.arange(800) / RATE
    x = np.exp(-t / 2.0) * np.cos(2 * np.pi * (FREQUENCY + 0.3) * t)
    plain = fit_sine(x, frequency_Hz=FREQUENCY, sample_rate_Hz=RATE)
    modulated = fit_sine(x, frequency_Hz=FREQUENCY, sample_rate_Hz=RATE, modulation=2)
    assert modulated.std < 0.05 * plain.std
    assert modulated.phasor == pytest.approx(plain.phasor, abs=5e-3)


def test_a_harmonic_that_meets_a_higher_mode_is_no_noise():
    t = np.arange(800) / RATE
    x = signal(800) + 0.6 * np.cos(2 * np.pi * 9 * FREQUENCY * t)
    fit = fit_sine(x, frequency_Hz=FREQUENCY, sample_rate_Hz=RATE, harmonics=LIMITS.fitted_harmonics, modulation=2)
    assert fit.std < 1e-10, "a wait would end at this share of the transient"
    assert abs(fit.harmonics[8]) == pytest.approx(0.6, abs=1e-10)


def test_too_few_samples_are_refused():
    with pytest.raises(ValueError, match="too few"):
        fit_sine(np.full(800, np.nan), frequency_Hz=FREQUENCY, sample_rate_Hz=RATE)
