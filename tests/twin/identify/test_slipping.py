"""A slider's harmonics against the energy of its loop and against the slider marched in time, alone and in balance."""

from __future__ import annotations

import numpy as np
import pytest
from slipping_numpy import slipping_harmonics_numpy

from twin.identify.jenkins import jenkins_harmonics
from twin.identify.slipping import slipping_harmonics
from twin.joint import jenkins

STIFFNESS, SLIP_FORCE = 2.5e6, 1.5
AMPLITUDES = SLIP_FORCE / STIFFNESS * np.array([0.3, 0.999, 1.001, 1.2, 1.5, 2.0, 2.1, 4.0, 30.0])
"""Below the displacement at which it slips, about that, and far beyond."""


def harmonics(amplitude, count=7):
    return jenkins_harmonics(amplitude, STIFFNESS, SLIP_FORCE, count)


def marched(amplitude, count, samples=4096):
    """Harmonics of the third period of a slider that began at rest."""
    t = 2 * np.pi * np.arange(3 * samples) / samples
    force = jenkins(STIFFNESS, SLIP_FORCE).force_history(amplitude * np.cos(t))[-samples:]
    return 2 * np.fft.rfft(force)[1 : count + 1] / samples


def test_energy_of_a_loop_is_what_slipping_dissipates():
    """4 F (a - F / k) for a slider that slips, nothing for one that sticks; pi a Im F_1 is the work of a cycle."""
    slips = SLIP_FORCE * (AMPLITUDES - SLIP_FORCE / STIFFNESS)
    energy = np.pi * AMPLITUDES * harmonics(AMPLITUDES)[:, 0].imag
    expected = 4 * np.maximum(slips, 0.0)
    assert energy == pytest.approx(expected, abs=1e-12 * SLIP_FORCE**2 / STIFFNESS, rel=1e-10)


def test_a_slider_marched_in_time_has_the_same_harmonics():
    found = harmonics(AMPLITUDES)
    expected = np.array([marched(a, 7) for a in AMPLITUDES])
    size = np.maximum(np.abs(expected[:, :1]), 1e-3)
    assert np.max(np.abs(found - expected) / size) < 1e-3


def test_the_first_harmonic_is_the_describing_function_in_closed_form():
    expected = jenkins(STIFFNESS, SLIP_FORCE).describing_function(AMPLITUDES) * AMPLITUDES
    assert harmonics(AMPLITUDES)[:, 0] == pytest.approx(expected, rel=1e-12)


def test_a_slider_that_sticks_is_a_spring():
    found = harmonics(AMPLITUDES[:2])
    assert found[:, 0] == pytest.approx(STIFFNESS * AMPLITUDES[:2])
    assert np.max(np.abs(found[:, 1:])) < 1e-9 * SLIP_FORCE


def test_a_slider_far_beyond_its_slip_is_dry_friction():
    """Against a velocity that lags by a quarter: odd harmonics 4 F / (pi h), all in phase with the velocity."""
    h = np.arange(1, 8)
    expected = np.where(h % 2 == 1, 4j * SLIP_FORCE / (np.pi * h), 0)
    assert harmonics([1e4 * SLIP_FORCE / STIFFNESS])[0] == pytest.approx(expected, abs=2e-2 * SLIP_FORCE)


def test_even_harmonics_vanish_since_both_ways_are_alike():
    assert np.max(np.abs(harmonics(AMPLITUDES)[:, 1::2])) < 1e-9 * SLIP_FORCE


def balanced(amplitude, compliance, samples=512, highest=41):
    """Harmonics 1 ... 7 of a marched slider whose slip has odd harmonics that its own force makes.

    The compliance (3,) is that at 3, 5 and 7 times the frequency, and beyond as at the last.
    """
    t = 2 * np.pi * np.arange(3 * samples) / samples
    orders = np.arange(3, highest + 1, 2)
    C = np.append(compliance, np.full(len(orders) - 3, compliance[-1]))
    waves, X = np.exp(1j * np.outer(orders, t)), np.zeros(len(orders), complex)
    share = 0.5 / (1 + STIFFNESS * np.max(np.abs(C)))
    for _ in range(int(9 / share)):
        force = jenkins(STIFFNESS, SLIP_FORCE).force_history(amplitude * np.cos(t) + (X @ waves).real)[-samples:]
        F = 2 * np.fft.rfft(force)[1 : highest + 1] / samples
        X = (1 - share) * X - share * C * F[orders - 1]
    return F[:7:2]


def errors(share, shape=(1.0, 1.1, 0.7)):
    """Of all harmonics over the fundamental, and of an element whose slip does not ripple; k C_h = share * shape."""
    compliance = share / STIFFNESS * np.array(shape)
    slips = AMPLITUDES[[3, 5, 7]]
    expected = np.array([balanced(a, compliance) for a in slips])
    found = slipping_harmonics(slips, STIFFNESS, SLIP_FORCE, np.tile(compliance, (len(slips), 1)))
    left, without = found - expected, harmonics(slips)[:, ::2] - expected
    return (np.max(np.abs(miss / expected[:, :1]), axis=0) for miss in (left, without))


def test_ripples_of_the_slip_are_in_balance_with_the_force_to_second_order():
    """Beyond what the compliances have in common; a ripple a quarter as large leaves an error an eighth as large."""
    left, without = errors(0.4)
    assert without[0] > 0.02
    assert np.max(left) < 0.01
    uneven, _ = errors(0.4, (1.0, 0.0, -0.6))
    small, _ = errors(0.1, (1.0, 0.0, -0.6))
    assert np.max(small) < np.max(uneven) / 8


@pytest.mark.slow
def test_a_structure_much_more_compliant_than_the_slider_is_in_balance_too():
    """As the tip of a joint is; an expansion about an element that stands alone would have nothing left of it."""
    left, without = errors(7.0, (1.0, 1.05, 0.9))
    assert without[0] > 0.1
    assert np.max(left) < 2e-3


def test_in_a_rigid_structure_and_below_its_slip_a_slider_is_alone():
    rigid = slipping_harmonics(AMPLITUDES, STIFFNESS, SLIP_FORCE, np.zeros((len(AMPLITUDES), 3)))
    assert rigid == pytest.approx(harmonics(AMPLITUDES)[:, ::2])
    compliant = slipping_harmonics(AMPLITUDES[:2], STIFFNESS, SLIP_FORCE, np.full((2, 3), 0.4 / STIFFNESS))
    assert compliant[:, 0] == pytest.approx(STIFFNESS * AMPLITUDES[:2])
    assert np.max(np.abs(compliant[:, 1:])) < 1e-9 * SLIP_FORCE


def test_compiled_and_plain_agree():
    """From a slider that sticks to one that hardly does, in a structure as compliant as the slider itself."""
    rng = np.random.default_rng(5)
    size = (len(AMPLITUDES), 3)
    compliance = (rng.standard_normal(size) + 1j * rng.standard_normal(size)) / STIFFNESS
    compiled, plain = (
        twin(AMPLITUDES, STIFFNESS, SLIP_FORCE, compliance) for twin in (slipping_harmonics, slipping_harmonics_numpy)
    )
    assert compiled == pytest.approx(plain, abs=1e-10 * np.max(np.abs(plain)))
