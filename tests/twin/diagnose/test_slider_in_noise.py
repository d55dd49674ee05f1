"""A slider's linear substitute against the slider marched under Gaussian motion, and against its known limits."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import roots_genlaguerre

from twin.diagnose.slider_in_noise import series_spring_and_rate, slider_in_noise
from twin.identify.jenkins import jenkins_harmonics
from twin.identify.model_modification import NoiseMotion
from twin.joint import jenkins

RATE_Hz, SECONDS = 8192, 60
RESONANCES_Hz = np.array([27.0, 160.0, 470.0])
WIDTH = 0.02


@pytest.fixture(scope="module", params=[(1.0, 0.1, 0.02), (1.0, 0.5, 0.3), (0.2, 1.0, 0.1)], ids=str)
def noise(request):
    """Gaussian motion in resonances of these rms displacements: its spectrum and its course."""
    frequency = np.fft.rfftfreq(RATE_Hz * SECONDS, 1 / RATE_Hz)
    rng = np.random.default_rng(6)
    lines = rng.standard_normal(len(frequency)) + 1j * rng.standard_normal(len(frequency))
    spectrum = np.zeros(len(frequency), complex)
    for centre, size in zip(RESONANCES_Hz, request.param, strict=True):
        peak = lines / (1 - (frequency / centre) ** 2 + 2j * WIDTH * frequency / centre) * (frequency < 3 * centre)
        spectrum += 1e-6 * size * peak / np.sqrt(np.sum(np.abs(peak) ** 2))
    course = np.fft.irfft(spectrum * len(frequency) * np.sqrt(2))
    motion = NoiseMotion(2 * np.pi * frequency[1:], np.abs(spectrum[1:]) ** 2)
    assert motion.displacement == pytest.approx(np.std(course), rel=1e-3)
    return motion, spectrum[1:], course


def about(centre_Hz, motion):
    return np.abs(motion.omega / (2 * np.pi * centre_Hz) - 1) < WIDTH


@pytest.mark.parametrize(
    "travel", [0.1, *(pytest.param(travel, marks=pytest.mark.slow) for travel in (0.02, 0.3, 0.6))]
)
def test_the_substitute_is_what_a_marched_slider_answers_at_every_resonance(noise, travel):
    """Least squares of its force on the motion; one stiffness for all of them, the best there is, is far off."""
    motion, spectrum, course = noise
    slip_force = 0.02
    k = slip_force / (travel * motion.displacement)
    force = jenkins(k, slip_force).force_history(course)
    answer = np.fft.rfft(force)[1:] / len(course) * np.sqrt(2)
    near = [about(centre, motion) for centre in RESONANCES_Hz]
    power = np.array([np.sum(motion.power[lines]) for lines in near])
    expected = np.array([np.vdot(spectrum[lines], answer[lines]) for lines in near]) / power
    found = slider_in_noise(motion, 2 * np.pi * RESONANCES_Hz, k, slip_force)

    missed = np.abs(found - expected)
    assert np.sum(power * missed**2) < 0.1**2 * np.sum(power * np.abs(expected) ** 2)
    # Where motion of another frequency is five times as large a third of the little force is missed at the worst.
    assert np.max(missed / np.abs(expected)) < (0.15 if travel < 0.5 else 0.35)
    one = np.sum(power * expected) / np.sum(power)
    assert np.max(np.abs(one - expected) / np.abs(expected)) > 0.5


def test_dry_friction_is_the_dashpot_that_gaussian_motion_makes_of_it(noise):
    """Bussgang's: sqrt(2 / pi) F over the rms velocity."""
    motion, *_ = noise
    stiffness, rate = series_spring_and_rate(motion, 1e9, 0.01)
    assert stiffness / rate == pytest.approx(np.sqrt(2 / np.pi) * 0.01 / motion.velocity, rel=0.01)


def test_a_slider_that_never_slips_is_a_spring(noise):
    motion, *_ = noise
    k = 1e4
    omega = 2 * np.pi * RESONANCES_Hz
    found = slider_in_noise(motion, omega, k, 30 * k * motion.displacement)
    assert found == pytest.approx(k, rel=1e-3)


@pytest.mark.parametrize("travel", [0.01, 0.1, 0.3, 0.6, 1.0, 2.0])
def test_in_noise_of_one_frequency_it_is_the_mean_describing_function(travel):
    """Over Rayleigh's amplitudes, weighted by their squares."""
    nodes, weights = roots_genlaguerre(60, 1.0)
    sigma, omega, k = 2e-6, 170.0, 3e4
    slip_force = travel * k * sigma
    amplitude = sigma * np.sqrt(2 * nodes)
    expected = np.sum(weights * jenkins_harmonics(amplitude, k, slip_force, 1)[:, 0] / amplitude)
    motion = NoiseMotion(np.array([omega]), np.array([sigma**2]))
    found = slider_in_noise(motion, np.array([omega]), k, slip_force)[0]
    assert abs(found - expected) < 0.05 * abs(expected)


def test_it_changes_smoothly_with_its_parameters(noise):
    """A fit takes differences of a millionth."""
    motion, *_ = noise
    omega, k, slip_force = 2 * np.pi * RESONANCES_Hz, 2e4, 2e4 * 0.4 * motion.displacement

    def slope(step):
        up, down = (slider_in_noise(motion, omega, k, slip_force * (1 + side * step)) for side in (1, -1))
        return (up - down) / (2 * step)

    assert np.max(np.abs(slope(1e-6) - slope(1e-3))) < 1e-3 * np.max(np.abs(slope(1e-3)))


@pytest.mark.parametrize(("k", "slip_force"), [(0.0, 0.1), (1e4, 0.0), (0.0, 0.0)])
def test_a_slider_without_stiffness_or_force_is_nothing_to_be_divided_by(noise, k, slip_force):
    found = slider_in_noise(noise[0], np.array([100.0]), k, slip_force)
    assert np.isfinite(found).all()
