"""Harmonics of contacts and openings against quadrature and root finding that share nothing with them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq

from twin.diagnose.one_sided import one_sided_harmonics
from twin.diagnose.opening import odd_force, opening_harmonics

SOFT_SHARE, SCALE = 0.6, 1.2e-6
"""A joint whose stiffness falls from 1 to 0.4 about openings of 1.2 um."""


def law(x: np.ndarray | float) -> np.ndarray | float:
    """Its odd force, in units of its linear stiffness."""
    return SOFT_SHARE * x / np.sqrt(1 + (np.asarray(x) / SCALE) ** 2) + (1 - SOFT_SHARE) * np.asarray(x)


def secant(amplitude: float) -> float:
    """Its describing function, by quadrature."""
    value = quad(lambda t: float(law(amplitude * np.cos(t))) * np.cos(t), 0, np.pi)[0]
    return 2 * value / (np.pi * amplitude)


AMPLITUDES = np.geomspace(5e-8, 5e-6, 120)
SECANTS = np.array([secant(a) for a in AMPLITUDES])


def test_the_force_is_found_back_from_its_describing_function():
    x, force = odd_force(AMPLITUDES, SECANTS)
    expected = np.asarray(law(x))
    assert np.max(np.abs(force - expected)) < 0.01 * np.max(expected)


@pytest.mark.parametrize("amplitude", [0.9e-6, 2e-6, 4e-6])
def test_the_second_harmonic_is_that_of_motion_about_the_mean_that_carries_no_force(amplitude):
    gap, factor = 6e-7, 0.8
    share = (factor - 1) / (factor + 1)

    def force(x: float) -> float:
        return float(law(x)) + share * max(float(law(abs(x))) - float(law(gap)), 0.0)

    def mean_force(shift: float) -> float:
        return quad(lambda t: force(shift + amplitude * np.cos(t)), 0, np.pi, limit=200)[0] / np.pi

    shift = brentq(mean_force, -amplitude, amplitude, xtol=1e-16)
    expected = 2 / np.pi * quad(lambda t: force(shift + amplitude * np.cos(t)) * np.cos(2 * t), 0, np.pi, limit=200)[0]
    at = int(np.argmin(np.abs(AMPLITUDES - amplitude)))
    amplitudes = AMPLITUDES.copy()
    amplitudes[at] = amplitude
    secants = SECANTS.copy()
    secants[at] = secant(amplitude)
    found = opening_harmonics(amplitudes, secants, gap=gap, factor=factor, count=4)[at]
    assert found[1].real == pytest.approx(expected, rel=0.06)
    assert found[[0, 2]] == pytest.approx(0.0)


def test_below_the_gap_nothing_opens():
    below = AMPLITUDES < 5e-7
    found = opening_harmonics(AMPLITUDES, SECANTS, gap=6e-7, factor=0.5, count=6)[below]
    assert np.max(np.abs(found)) < 1e-6 * np.max(AMPLITUDES)


def test_one_sided_contact_against_a_fourier_transform():
    amplitude, gap = np.array([0.5, 1.0, 1.7, 6.0]), 0.9
    t = 2 * np.pi * np.arange(1 << 14) / (1 << 14)
    force = np.maximum(amplitude[:, None] * np.cos(t) - gap, 0.0)
    expected = 2 * np.fft.rfft(force).real / len(t)
    assert one_sided_harmonics(amplitude, gap, 6) == pytest.approx(expected[:, 1:7], abs=1e-6)
