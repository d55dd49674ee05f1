"""A slider's harmonics against the energy of its loop and against the slider marched in time, alone and in balance."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.slipping import jenkins_harmonics, slipping_harmonics, slipping_harmonics_numpy
from twin.joint import jenkins

STIFFNESS, SLIP_FORCE = 2.5e6, 1.5
AMPLITUDES = SLIP_FORCE / STIFFNESS * np.array([0.3, 0.999, 1.001, 1.2, 1.5, 2.0, 2.1, 4.0, 30.0])
"""Below the displacement at which it slips, about that, and far beyond."""


def harmonics(amplitude, count=7):
    return jenkins_harmonics(amplitude, STIFFNESS, SLIP_FORCE, count)


def marched(amplitude, count, samples=4096):
    """Harmonics of the third period of a slider that began at rest."""
    t = 2 * np.pi * np.arange(3 * samples) / samples
    force = jenkins(STIFFNESS, SLIP_FORCE).path(amplitude * np.cos(t))[-samples:]
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
    expected = jenkins(STIFFNESS, SLIP_FORCE).stiffness(AMPLITUDES) * AMPLITUDES
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


def balanced(amplitude, compliance, samples=1024):
    """Harmonics 1 ... 7 of a marched slider whose slip has harmonics 3, 5 and 7 that its own force makes."""
    t = 2 * np.pi * np.arange(3 * samples) / samples
    X = np.zeros(3, complex)
    for _ in range(25):
        ripple = (X @ np.exp(1j * np.outer((3, 5, 7), t))).real
        force = jenkins(STIFFNESS, SLIP_FORCE).path(amplitude * np.cos(t) + ripple)[-samples:]
        F = 2 * np.fft.rfft(force)[1:8] / samples
        X = 0.5 * X - 0.5 * compliance * F[[2, 4, 6]]
    return F[::2]


def first_harmonic_errors(share):
    """Relative errors with the ripples and without them, where the slip is so compliant that k C_h = share."""
    compliance = share / STIFFNESS * np.array([1.0, 1.1, 0.7])
    slips = AMPLITUDES[3:-1]
    expected = np.array([balanced(a, compliance)[0] for a in slips])
    found = slipping_harmonics(slips, STIFFNESS, SLIP_FORCE, np.tile(compliance, (len(slips), 1)))[:, 0]
    return np.abs(found / expected - 1), np.abs(harmonics(slips)[:, 0] / expected - 1)


def test_ripples_of_the_slip_are_in_balance_with_the_force_to_second_order():
    """A ripple a quarter as large leaves an error a sixteenth as large, but for the marched samples' own."""
    left, without = first_harmonic_errors(0.4)
    assert np.max(without) > 0.02
    assert np.max(left) < 0.3 * np.max(without)
    small, _ = first_harmonic_errors(0.1)
    assert np.max(small) < np.max(left) / 8


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
