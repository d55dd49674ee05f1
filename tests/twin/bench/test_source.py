"""The bench as a source of samples: rates, indices, time, phase."""

from __future__ import annotations

import numpy as np
import pytest

from recordings.streams import Excitation
from twin.bench import BenchSetup, open_bench
from twin.bench.limits import LIMITS
from twin.rigs import load_rig

RIG = load_rig("steel-lap-joint")


def envelope(values, rate, frequency_Hz):
    t = np.arange(len(values)) / rate
    return 2 * abs(np.mean(values * np.exp(-2j * np.pi * frequency_Hz * t)))


def test_indices_and_times_run_on_through_a_change_of_rate_and_so_does_the_motion():
    bench = open_bench(RIG, setup=BenchSetup(noise=False))
    bench.set_output(Excitation(kind="sine", amplitude_V=0.5, frequency_Hz=26.0))
    bench.read(1024 * 20)
    before = bench.read(1024)
    assert (before.first_index, before.time_ns) == (20480, 20_000_000_000)
    assert bench.set_sample_rate(5000.0) == 5120.0
    bench.read(512)  # the filter of the new rate fills
    after = bench.read(5120)
    assert (after.first_index, after.time_ns) == (20480 + 1024 + 512, 21_100_000_000)
    assert after.sample_rate_Hz == bench.sample_rate_Hz == 5120.0
    for channel in ("force", "acc2"):
        a = envelope(before.samples[channel], 1024, 26.0)
        assert envelope(after.samples[channel], 5120, 26.0) == pytest.approx(a, rel=5e-3)


def test_a_new_frequency_makes_no_jump():
    bench = open_bench(RIG, sample_rate_Hz=12800.0, setup=BenchSetup(noise=False, monitors=("voltage",)))
    bench.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=26.0))
    bench.read(1700)
    bench.set_output(Excitation(kind="sine", amplitude_V=1.0, frequency_Hz=31.0))
    voltage = bench.read(400).samples["voltage"]
    assert np.abs(np.diff(voltage)).max() < 2 * np.pi * 31.5 / 12800


def test_random_excitation_has_its_rms_and_its_band():
    bench = open_bench(RIG, sample_rate_Hz=4096.0, setup=BenchSetup(noise=False, monitors=("voltage",)))
    bench.set_output(Excitation(kind="random", amplitude_V=0.3, band_Hz=(50.0, 500.0), seed=2))
    bench.read(4096)
    voltage = bench.read(4096 * 10).samples["voltage"].astype(float)
    assert np.std(voltage) == pytest.approx(0.3, rel=0.03)
    power = np.abs(np.fft.rfft(voltage)) ** 2
    frequency = np.fft.rfftfreq(len(voltage), 1 / 4096)
    inside = (frequency > 30) & (frequency < 750)
    assert power[inside].sum() > 0.99 * power.sum()


def test_noise_has_the_density_of_the_data_sheet():
    for rate in (1024.0, 10240.0):
        values = open_bench(RIG, seed=3, sample_rate_Hz=rate).read(20000).samples["acc1"]
        assert np.std(values) == pytest.approx(5e-4 * np.sqrt(rate / 2), rel=0.03)


def test_rubbish_is_refused():
    bench = open_bench(RIG)
    with pytest.raises(ValueError, match="must be positive"):
        bench.set_sample_rate(0.0)
    with pytest.raises(ValueError, match="0 < low < high"):
        bench.set_output(Excitation(kind="random", amplitude_V=1.0, band_Hz=(100.0, 50.0)))
    with pytest.raises(ValueError, match="finite"):
        bench.set_output(Excitation(kind="sine", amplitude_V=float("nan"), frequency_Hz=20.0))
    assert bench.set_sample_rate(1e9) == max(LIMITS.sample_rates_Hz)
    with pytest.raises(ValueError, match="highest sample rate, 204800 Hz"):
        open_bench(RIG, sample_rate_Hz=1e6)
