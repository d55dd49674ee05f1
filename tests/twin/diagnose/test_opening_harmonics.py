"""Harmonics of an opening joint against root finding and quadrature that share nothing with them."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.optimize import brentq, root

from twin.diagnose.opening import odd_force, opening_harmonics
from twin.identify.extension import JointState

SOFT_SHARE, SCALE = 0.6, 1.2e-6
"""A joint whose stiffness falls from 1 to 0.4 about openings of 1.2 um."""
GAP, FACTOR = 6e-7, 0.8
AMPLITUDES = np.geomspace(5e-8, 5e-6, 120)
ANGLE = 2 * np.pi * (np.arange(1024) + 0.5) / 1024
COUNT = 6


def joint_state(left, compliance):
    """At a frequency that does not matter to the opening."""
    return JointState(left, compliance, np.full(len(left), 166.0))


def odd_law(x):
    """Its odd force, in units of its linear stiffness."""
    x = np.asarray(x)
    return SOFT_SHARE * x / np.sqrt(1 + (x / SCALE) ** 2) + (1 - SOFT_SHARE) * x


def slapping(x, factor=FACTOR, gap=GAP):
    """The whole force: where it opens beyond the gap, it goes on with another slope, and where it closes, with less."""
    share = (factor - 1) / (factor + 1)
    return odd_law(x) + share * np.maximum(odd_law(np.abs(x)) - odd_law(gap), 0.0)


def secant(amplitude):
    """The odd force's describing function, by adaptive quadrature."""
    value = quad(lambda t: float(odd_law(amplitude * np.cos(t))) * np.cos(t), 0, np.pi)[0]
    return 2 * value / (np.pi * amplitude)


def coefficients(samples, count=COUNT):
    """Complex Fourier coefficients 0 ... count, F(t) = Re sum F_h exp(j h t)."""
    weights = np.exp(-1j * np.arange(count + 1)[:, None] * ANGLE) * 2 / len(ANGLE)
    weights[0] /= 2
    return weights @ samples


def free_mean(amplitude):
    """Motion about the mean opening at which the mean force vanishes."""

    def mean(shift):
        return np.mean(slapping(shift + amplitude * np.cos(ANGLE)))

    return brentq(mean, -amplitude, amplitude, xtol=1e-18) + amplitude * np.cos(ANGLE)


def surrounded(amplitude, compliance):
    """Motion in balance with a structure that takes every harmonic but the first, X = -C (F - N x), by SciPy's root.

    N, the whole joint's secant stiffness, follows from the motion itself.
    """
    orders = np.array([0, *range(2, len(compliance))])

    def motion(parts):
        X = parts[: len(orders)] + 1j * np.append(0.0, parts[len(orders) :])
        return amplitude * (np.cos(ANGLE) + np.real(X @ np.exp(1j * orders[:, None] * ANGLE)))

    def unbalance(parts):
        x = motion(parts)
        force = slapping(x)
        N = coefficients(force, 1)[1].real / amplitude
        F = coefficients(force - N * x, len(compliance) - 1)[orders] / amplitude
        left = parts[: len(orders)] + 1j * np.append(0.0, parts[len(orders) :]) + compliance[orders] * F
        return np.concatenate([left.real, left.imag[1:]])

    solution = root(unbalance, np.zeros(2 * len(orders) - 1), tol=1e-12)
    assert np.max(np.abs(unbalance(solution.x))) < 1e-9
    return motion(solution.x)


def expected(motions):
    """Share of stiffness left, and the force's even harmonics beyond it, of motions (s, t)."""
    left = np.array([coefficients(slapping(x), 1)[1].real / a for x, a in zip(motions, AMPLITUDES, strict=True)])
    rest = [slapping(x) - N * x for x, N in zip(motions, left, strict=True)]
    harmonics = np.array([coefficients(values) for values in rest])[:, 1:]
    harmonics[:, ::2] = 0.0
    return left, harmonics


def departure(found, harmonics):
    """Largest error of each even harmonic beside the largest it has."""
    even = slice(1, None, 2)
    return np.max(np.abs(found - harmonics)[:, even], axis=0) / np.max(np.abs(harmonics)[:, even], axis=0)


def test_the_force_is_found_back_from_its_describing_function():
    x, force = odd_force(AMPLITUDES, np.array([secant(a) for a in AMPLITUDES]))
    assert x[-1] == pytest.approx(AMPLITUDES[-1])
    law = odd_law(x)
    assert np.max(np.abs(force - law)) < 0.01 * np.max(law)


def test_the_force_of_a_hardening_joint_is_found_back_too():
    """A cubic spring's describing function is three quarters of its amplitude squared, in closed form."""
    amplitude = np.linspace(1e-7, 3e-6, 90)
    x, force = odd_force(amplitude, 1 + 0.75 * (amplitude / SCALE) ** 2)
    law = x + x**3 / SCALE**2
    assert np.max(np.abs(force - law)) < 0.02 * np.max(law)


def test_scatter_of_the_secants_hardly_moves_the_force():
    noise = 1e-3 * np.random.default_rng(5).standard_normal(len(AMPLITUDES))
    x, force = odd_force(AMPLITUDES, np.array([secant(a) for a in AMPLITUDES]) * (1 + noise))
    law = odd_law(x)
    assert np.max(np.abs(force - law)) < 0.02 * np.max(law)


def test_a_layer_free_to_open_moves_about_the_mean_that_carries_no_force():
    """With the layer's own compliance and no other at rest, X_0 = -(F_0 - N X_0) / N says that F_0 vanishes."""
    left, harmonics = expected(np.array([free_mean(a) for a in AMPLITUDES]))
    compliance = np.zeros((len(left), 8))
    compliance[:, 0] = 1 / left
    found = opening_harmonics(AMPLITUDES, joint_state(left, compliance), gap=GAP, factor=FACTOR, count=COUNT)
    assert np.max(departure(found, harmonics)) < 0.015


def test_a_layer_held_by_what_surrounds_it_moves_as_the_fundamental_alone():
    left, harmonics = expected(np.array([a * np.cos(ANGLE) for a in AMPLITUDES]))
    joint = joint_state(left, np.zeros((len(left), 8)))
    found = opening_harmonics(AMPLITUDES, joint, gap=GAP, factor=FACTOR, count=COUNT)
    assert np.max(departure(found, harmonics)) < 0.015


def test_harmonics_are_in_balance_with_a_structure_that_resonates_among_them():
    """A structure stiff at rest, near a damped resonance at the second harmonic, and all inertia beyond it."""
    orders = np.arange(8)
    compliance = 1.6 / (3 - orders**2 * 0.6 + 0.2j * orders)
    left, harmonics = expected(np.array([surrounded(a, compliance) for a in AMPLITUDES]))
    joint = joint_state(left, np.tile(compliance, (len(left), 1)))
    found = opening_harmonics(AMPLITUDES, joint, gap=GAP, factor=FACTOR, count=COUNT)
    assert np.max(departure(found, harmonics)) < 0.05
    held = opening_harmonics(AMPLITUDES, joint_state(left, 0j * joint.compliance), gap=GAP, factor=FACTOR, count=COUNT)
    # What surrounds the joint matters here, or the test would show nothing.
    assert np.min(departure(held, harmonics)) > 0.15


def test_below_the_gap_nothing_opens():
    below = AMPLITUDES < 0.8 * GAP
    joint = joint_state(np.array([secant(a) for a in AMPLITUDES]), np.full((len(AMPLITUDES), 8), 0.5 + 0j))
    found = opening_harmonics(AMPLITUDES, joint, gap=GAP, factor=0.5, count=COUNT)
    assert np.max(np.abs(found[below])) < 1e-6 * np.max(np.abs(found))


def test_a_joint_that_opens_as_it_closes_has_no_even_harmonics():
    joint = joint_state(np.array([secant(a) for a in AMPLITUDES]), np.full((len(AMPLITUDES), 8), 0.5 + 0j))
    found = opening_harmonics(AMPLITUDES, joint, gap=GAP, factor=1.0, count=COUNT)
    assert np.max(np.abs(found)) < 1e-9 * AMPLITUDES[-1]
