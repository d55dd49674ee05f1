"""What a channel does to its signal."""

from dataclasses import replace

import numpy as np
import pytest

from tests.second_bench.believed import BITS, TRANSDUCERS, HIGH_PASS_Hz
from tests.second_bench.channels import Reading, Wiring
from tests.second_bench.sine_wave import fundamental

RATE_Hz = 8192
QUIET = Wiring(gain=1.0, corner_Hz=HIGH_PASS_Hz, noise_density=0.0, low_share=0.0, low_Hz=5.0)


def read(signal, wiring, *, blocks=8):
    reading = Reading(TRANSDUCERS[1], wiring, rate_Hz=RATE_Hz, keep_each=4, rng=np.random.default_rng(3))
    return np.concatenate([reading.read(block, stored=True)[0] for block in np.split(signal, blocks)])


def sine(frequency_Hz, seconds=4):
    phases = 2 * np.pi * frequency_Hz / RATE_Hz * np.arange(seconds * RATE_Hz)
    return 10 * np.sin(phases), phases[::4]


@pytest.mark.parametrize("frequency_Hz", [26.3, 156.0, 900.0])
@pytest.mark.parametrize("delay_s", [3e-5, 2e-4, 7e-4])
def test_a_delay_turns_the_phase(frequency_Hz, delay_s):
    signal, phases = sine(frequency_Hz)
    late, sound = (read(signal, replace(QUIET, delay_s=d)).astype(float)[-2048:] for d in (delay_s, 0.0))
    ratio = fundamental(late, phases[-2048:]) / fundamental(sound, phases[-2048:])
    assert abs(ratio - np.exp(-2j * np.pi * frequency_Hz * delay_s)) < 1e-4


def test_a_gain_scales():
    signal, _ = sine(26.3)
    assert read(signal, replace(QUIET, gain=1.04)) == pytest.approx(1.04 * read(signal, QUIET), abs=1e-4)


def test_slow_signals_are_lost_to_the_coupling():
    after = np.exp(-2 * np.pi * HIGH_PASS_Hz * 4)
    assert read(np.ones(4 * RATE_Hz), QUIET)[-1] == pytest.approx(after, rel=1e-3)


def test_samples_are_multiples_of_the_converters_step_within_its_range():
    signal = np.linspace(-600, 600, RATE_Hz)
    samples = read(np.diff(signal, prepend=0.0) * 0 + signal, replace(QUIET, corner_Hz=1e-6)).astype(float)
    limit = TRANSDUCERS[1].range
    assert samples.max() == samples.min() * -1 == limit
    steps = samples / (2 * limit / 2**BITS)
    assert steps == pytest.approx(np.rint(steps), abs=0.5)


def test_noise_has_its_density_and_more_below():
    density = 5e-4
    quiet = read(np.zeros(64 * RATE_Hz), replace(QUIET, noise_density=density, low_share=3.0)).astype(float)
    power = np.abs(np.fft.rfft(quiet)) ** 2 * 2 / (len(quiet) * RATE_Hz / 4)
    frequency = np.fft.rfftfreq(len(quiet), 4 / RATE_Hz)
    assert np.sqrt(power[frequency > 500].mean()) == pytest.approx(density, rel=0.02)
    assert np.sqrt(power[(frequency > 0.5) & (frequency < 2)].mean()) == pytest.approx(density * 10**0.5, rel=0.2)


def test_hum_is_added():
    hum = read(np.zeros(2 * RATE_Hz), replace(QUIET, hum=((50.0, 0.2, 0.4),))).astype(float)
    phases = 2 * np.pi * 50.0 * np.arange(len(hum)) / (RATE_Hz / 4)
    assert abs(fundamental(hum, phases) - 0.2 * np.exp(0.4j)) < 1e-4
