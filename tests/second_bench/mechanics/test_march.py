"""Marching in time against the frequency domain, and against itself with a finer step."""

from dataclasses import replace

import numpy as np
import pytest

from tests.second_bench.believed import BELIEVED, SHAKER
from tests.second_bench.mechanics.laws import Kind
from tests.second_bench.mechanics.march import at_rest, march, recurrence
from tests.second_bench.mechanics.specimen import GroundElement
from tests.second_bench.mechanics.structure import modes_of
from tests.second_bench.plans import Noise
from tests.second_bench.shaker import Distortion, noise, sine
from tests.second_bench.sine_wave import fundamental

PURE = Distortion(np.zeros(0), np.zeros(0))


def receptance(specimen, *, force, frequency_Hz, rate_Hz, seconds):
    """Of both sensors when they have settled, m/N."""
    modes = modes_of(specimen)
    phases = 2 * np.pi * frequency_Hz / rate_Hz * np.arange(1, round(seconds * rate_Hz) + 1)
    marched, read = sine(force, frequency_Hz, PURE, phases, rate_Hz)
    responses = march(modes, at_rest(modes), marched, rate_Hz)[:, -rate_Hz:]
    last = phases[-rate_Hz:]
    amplitudes = np.array([fundamental(response, last) for response in responses])
    return -amplitudes / (2 * np.pi * frequency_Hz) ** 2 / fundamental(read[-rate_Hz:], last)


@pytest.mark.parametrize(("frequency_Hz", "rate_Hz", "seconds"), [(26.3, 8192, 30), (156.0, 20480, 12)])
def test_at_small_amplitude_it_is_the_linear_rig(frequency_Hz, rate_Hz, seconds):
    found = receptance(BELIEVED, force=1e-5, frequency_Hz=frequency_Hz, rate_Hz=rate_Hz, seconds=seconds)
    linear = modes_of(BELIEVED).receptance(np.array([frequency_Hz]))[0]
    assert np.abs(found / linear - 1).max() < 1e-4


def test_under_load_a_finer_step_changes_little():
    coarse, fine = (
        receptance(BELIEVED, force=3.0, frequency_Hz=26.2, rate_Hz=rate, seconds=20) for rate in (6144, 24576)
    )
    assert np.abs(coarse / fine - 1).max() < 1e-3


def test_a_dashpot_damps_as_it_does_in_the_frequency_domain():
    damped = replace(BELIEVED, ground=(GroundElement(Kind.DASHPOT, 0.42, (0.5,)),))
    found = receptance(damped, force=1e-5, frequency_Hz=26.3, rate_Hz=8192, seconds=20)
    modes = modes_of(damped)
    w = 2 * np.pi * 26.3
    places = np.vstack([modes.drive, modes.elements[-1], modes.sensors])
    H = (places / (modes.omega**2 - w**2 + 2j * modes.damping * modes.omega * w)) @ places.T
    held = H[2:, 0] - H[2:, 1] * 1j * w * 0.5 / (1 + 1j * w * 0.5 * H[1, 1]) * H[1, 0]
    assert np.abs(found / held - 1).max() < 1e-3


def test_a_mode_is_carried_exactly_under_a_force_that_is_linear_between_samples():
    omega, zeta, h = np.array([30.0]), np.array([0.05]), 0.02
    whole = recurrence(omega, zeta, h)[:, 0]
    half = recurrence(omega, zeta, h / 2)[:, 0]

    def step(c, q, p, g0, g1):
        return c[0] * q + c[1] * p + c[2] * g0 + c[3] * g1, c[4] * q + c[5] * p + c[6] * g0 + c[7] * g1

    at_once = step(whole, 0.3, -2.0, 5.0, 9.0)
    in_two = step(half, *step(half, 0.3, -2.0, 5.0, 7.0), 7.0, 9.0)
    assert at_once == pytest.approx(in_two, rel=1e-12)


def test_noise_at_small_amplitude_meets_the_linear_rig_over_the_whole_band():
    plan = Noise()
    modes = modes_of(BELIEVED)
    period = 4 * plan.march_Hz
    marched, read = noise(
        np.random.default_rng(1), modes, SHAKER, band_Hz=plan.band_Hz, rms=1e-5, samples=period, rate_Hz=plan.march_Hz
    )
    state = at_rest(modes)
    for _ in range(5):  # the first mode's transient falls to e^-6
        responses = march(modes, state, marched, plan.march_Hz)
    frequency = np.fft.rfftfreq(period, 1 / plan.march_Hz)
    inside = (frequency > 100.0) & (frequency < 990.0)
    spectra = np.fft.rfft(np.vstack([read, responses]))[:, inside]
    found = -(spectra[1:] / spectra[0]).T / (2 * np.pi * frequency[inside, None]) ** 2
    linear = modes.receptance(frequency[inside])
    assert np.median(np.abs(found / linear - 1), axis=0).max() < 1e-4
