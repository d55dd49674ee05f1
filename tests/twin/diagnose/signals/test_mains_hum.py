"""A line of the mains is seen through sines and noise, with its amplitude; the sines' own harmonics are not hum."""

from __future__ import annotations

import numpy as np
import pytest

from twin.causes.mains_hum.finding import find_mains_hum


def humming(synthetic, seed, frequency_Hz, amplitude, **options):
    """A sweep with hum on the first accelerometer."""
    samples = synthetic.converted(synthetic.stepped_sine(seed, **options))
    t = np.arange(len(samples["acc1"])) / synthetic.rate_Hz
    return {
        "force": samples["force"],
        "acc1": samples["acc1"] + amplitude * np.cos(2 * np.pi * frequency_Hz * t + seed),
    }


@pytest.mark.parametrize("frequency_Hz", [50.0, 60.0, 150.0])
def test_hum_far_below_the_samples_noise_is_found(synthetic, frequency_Hz):
    """A third of the noise's rms: two thousand samples a step bring it out."""
    amplitude = 0.3 * synthetic.noise["acc1"]
    (finding,) = find_mains_hum([synthetic.run(humming(synthetic, 41, frequency_Hz, amplitude))])
    assert finding.cause == "mains-hum"
    assert finding.names == {"channel": "acc1"}
    assert finding.values["frequency_Hz"] == frequency_Hz
    assert finding.values["amplitude"] == pytest.approx(amplitude, abs=4 * finding.std["amplitude"])


@pytest.mark.slow
def test_its_amplitude_is_as_uncertain_as_stated(synthetic):
    """Over a dozen sweeps with noise of their own."""
    amplitude = 0.5 * synthetic.noise["acc1"]
    found = [find_mains_hum([synthetic.run(humming(synthetic, seed, 50.0, amplitude))]) for seed in range(50, 62)]
    errors = np.array([(f.values["amplitude"] - amplitude) / f.std["amplitude"] for (f,) in found])
    assert np.sqrt(np.mean(errors**2)) < 2.0


def test_a_line_close_to_the_drives_second_harmonic_loses_nothing_to_it(synthetic):
    """Less than two bins apart, where what the harmonic's fit takes off has some per cent of the line in it."""
    frequencies, amplitude = np.linspace(24.05, 24.2, 16), 20 * synthetic.noise["acc1"]
    samples = humming(synthetic, 44, 50.0, amplitude, frequencies_Hz=frequencies)
    (finding,) = find_mains_hum([synthetic.run(samples, frequencies)])
    assert finding.values["amplitude"] == pytest.approx(amplitude, rel=2e-3)


def test_sweeps_and_noise_without_hum_are_no_alarm(clean_runs):
    for runs in clean_runs:
        assert find_mains_hum(runs) == []


def test_a_sweep_about_the_mains_frequency_is_no_hum(synthetic):
    """Steps at 25 and 50 Hz have their own lines where the mains would be."""
    frequencies = np.concatenate([np.linspace(24.6, 25.4, 9), np.linspace(49.6, 50.4, 9)])
    samples = synthetic.converted(synthetic.stepped_sine(42, frequencies_Hz=frequencies))
    assert find_mains_hum([synthetic.run(samples, frequencies)]) == []


@pytest.mark.parametrize("seed", range(40, 52))
def test_noise_alone_is_no_hum(synthetic, seed):
    samples = synthetic.converted(synthetic.random(seed))
    assert find_mains_hum([synthetic.run(samples, [0.0], step_s=12.0)]) == []


def test_hum_in_a_broadband_run_is_found_beside_what_the_force_makes(synthetic):
    """Where there are no sines, or all are too close to half the mains' frequency."""
    errors = []
    for seed in range(60, 68):
        samples = synthetic.converted(synthetic.random(seed))
        t = np.arange(len(samples["acc1"])) / synthetic.rate_Hz
        humming = {**samples, "acc1": samples["acc1"] + 0.5 * np.cos(2 * np.pi * 60.0 * t + seed)}
        (finding,) = find_mains_hum([synthetic.run(humming, [0.0], step_s=12.0)])
        assert finding.names == {"channel": "acc1"}
        assert finding.values["frequency_Hz"] == 60.0
        errors.append((finding.values["amplitude"] - 0.5) / finding.std["amplitude"])
    assert np.sqrt(np.mean(np.square(errors))) < 2.0
