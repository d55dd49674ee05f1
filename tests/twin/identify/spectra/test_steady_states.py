"""Harmonics of measured steps and their stated covariance, against signals whose harmonics and noise are known."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import lfilter

from recordings.run import Channel, DeviceSamples, Run, Step, StepState
from twin.identify.spectra import sine_fit
from twin.identify.spectra.sine_fit import Line, steady_states

RATE, FREQUENCY, START = 2048.0, 26.45, 0.137
HARMONICS = np.array([2.0 * np.exp(0.7j), 0.02 * np.exp(2j), 0.05 * np.exp(-1.1j)])
OMEGA = 2 * np.pi * FREQUENCY


def sine(t, amplitudes=HARMONICS, omega=OMEGA):
    """An offset and harmonics whose phases count from the measurement's start."""
    return 0.3 + sum(np.real(Z * np.exp(1j * h * omega * (t - START))) for h, Z in enumerate(amplitudes, 1))


def recorded(samples, seconds, *, frequency=FREQUENCY, channel_range=None, start=START):
    """A run of one step; `samples` maps a channel to (values, rate, time of the first in seconds)."""
    channels, devices = {}, {}
    for name, (values, rate, begin) in samples.items():
        channels[name] = Channel(name=name, quantity="acceleration", unit="m/s^2", device=name, range=channel_range)
        devices[name] = DeviceSamples(
            device=name, sample_rate_Hz=rate, values={name: np.asarray(values, np.float32)},
            block_start=np.array([0]), block_time_ns=np.array([round(begin * 1e9)]), overload={},
        )  # fmt: skip
    about = {"sweep": "1N-up", "index": 3, "frequency_Hz": frequency, "target_channel": "a", "target_amplitude": 1.0}
    steps = tuple(
        Step(time_ns=round(t * 1e9), state=state, **about)
        for t, state in ((start, StepState.MEASURING), (start + seconds, StepState.DONE))
    )
    return Run(path="r", info={}, channels=channels, devices=devices, steps=steps, events=())


def one(values, seconds, **options):
    """The one steady state of channel a."""
    (state,) = steady_states(recorded({"a": (values, RATE, 0.0)}, seconds, **options))
    return state


def times(seconds):
    """Of all samples of a recording that goes on a little after the measurement."""
    return np.arange(int((START + seconds + 0.1) * RATE)) / RATE


@pytest.mark.parametrize("periods", [2.3, 3.0, 7.41, 26.0, 53.7])
def test_harmonics_are_exact_over_any_part_of_a_period(periods):
    seconds = periods / FREQUENCY
    state = one(sine(times(seconds)), seconds)
    # Recordings are single precision.
    np.testing.assert_allclose(state.amplitude["a"][:3], HARMONICS, atol=1e-6)
    assert np.all(np.abs(state.amplitude["a"][3:]) < 1e-6)
    assert (state.sweep, state.index, state.lost, state.overloaded) == ("1N-up", 3, 0, 0)


def test_devices_with_clocks_of_their_own_agree():
    rates, begins = (2048.0, 1000.0), (0.0, 0.0123)
    samples = {n: (sine(b + np.arange(int(1.3 * r)) / r), r, b) for n, r, b in zip("ab", rates, begins, strict=True)}
    (state,) = steady_states(recorded(samples, 1.0))
    np.testing.assert_allclose(state.amplitude["a"][:3], HARMONICS, atol=1e-6)
    np.testing.assert_allclose(state.amplitude["b"][:3], HARMONICS, atol=1e-6)


def test_lost_samples_cost_precision_only_and_are_counted():
    values = sine(times(1.0))
    values[500:800], values[1200] = np.nan, np.nan
    state = one(values, 1.0)
    assert state.lost == 301
    np.testing.assert_allclose(state.amplitude["a"][:3], HARMONICS, atol=1e-6)


def test_samples_on_the_converters_limit_are_counted():
    t = times(1.0)
    clipped = np.clip(sine(t), -2.0, 2.0)
    inside = (t >= START - 1e-6) & (t < START + 1.0 - 1e-6)
    assert one(clipped, 1.0, channel_range=2.0).overloaded == np.sum(np.abs(clipped[inside]) == 2.0) > 0


@pytest.fixture(scope="module")
def repeated():
    """400 measurements of a second in white noise of 0.1 at 2048 samples a second."""
    rng, t = np.random.default_rng(7), times(1.0)
    return [one(sine(t) + 0.1 * rng.standard_normal(len(t)), 1.0) for _ in range(400)]


@pytest.mark.parametrize("order", [1, 2, 3, 10])
def test_the_stated_variance_is_that_of_white_noise(repeated, order):
    """E|error|^2 = 4 sigma^2 / N of a complex amplitude; estimated from two dozen lines it scatters by a fifth."""
    expected = 4 * 0.1**2 / RATE
    variance = np.array([state.variance["a"][order - 1] for state in repeated])
    assert np.mean(variance) == pytest.approx(expected, rel=0.05)
    assert np.std(variance) / np.mean(variance) < 0.35


@pytest.mark.parametrize("order", [1, 2, 3, 10])
def test_the_stated_variance_covers_the_error(repeated, order):
    truth = HARMONICS[order - 1] if order < 4 else 0.0
    error = np.array([abs(state.amplitude["a"][order - 1] - truth) ** 2 for state in repeated])
    variance = np.array([state.variance["a"][order - 1] for state in repeated])
    assert np.mean(error / variance) == pytest.approx(1.0, abs=0.2)
    # Of a circular error exp(-3) = 5 % lie beyond three variances; of 400 that is 20, give or take 4.4.
    assert 0.02 < np.mean(error > 3 * variance) < 0.10


def test_coloured_noise_is_estimated_where_each_harmonic_is():
    """A first-order low-pass in discrete time, whose spectrum is sigma^2 / |1 - a exp(-j theta)|^2."""
    rng, t, a = np.random.default_rng(8), times(2.0), 0.97
    states = [one(sine(t) + lfilter([0.02], [1, -a], rng.standard_normal(len(t))), 2.0) for _ in range(60)]
    for order in (1, 3, 8):
        spectrum = 0.02**2 / abs(1 - a * np.exp(-1j * OMEGA * order / RATE)) ** 2
        mean = np.mean([state.variance["a"][order - 1] for state in states])
        # Lines a quarter of the frequency away see another level: within a fifth at the fundamental.
        assert mean == pytest.approx(4 * spectrum / (2 * RATE), rel=0.2)


def test_a_drift_moves_neither_the_mean_amplitude_nor_the_noise():
    """The amplitude grows by two per cent over the measurement: what is stated is its middle, and the change."""
    t = times(1.0)
    part = (t - START) - 0.5
    carrier = 2.0 * np.exp(1j * (OMEGA * (t - START) + 0.7))
    noise = 0.01 * np.random.default_rng(9).standard_normal(len(t))
    still, drifting = one(carrier.real + noise, 1.0), one(((1 + (0.02 + 0.01j) * part) * carrier).real + noise, 1.0)
    std = np.sqrt(still.variance["a"][0])
    assert abs(drifting.amplitude["a"][0] - 2.0 * np.exp(0.7j)) < 4 * std
    np.testing.assert_allclose(drifting.variance["a"], still.variance["a"], rtol=0.05)
    assert drifting.drift["a"] == pytest.approx(0.02 + 0.01j, abs=6 * drifting.drift_std["a"])
    assert abs(drifting.drift["a"]) > 20 * drifting.drift_std["a"]
    assert abs(still.drift["a"]) < 6 * still.drift_std["a"]


def test_the_drifts_stated_deviation_is_its_scatter(repeated):
    drift = np.array([state.drift["a"] for state in repeated])
    stated = np.mean([state.drift_std["a"] for state in repeated])
    assert np.std(drift.real) == pytest.approx(stated, rel=0.12)
    assert np.std(drift.imag) == pytest.approx(stated, rel=0.12)


@pytest.mark.parametrize("tail", [0.01, 0.05, 0.2])
def test_a_transient_that_still_dies_away_shows_as_a_drift(tail):
    """The resonance's own decay beside the drive: 26.3 Hz, a damping ratio of 0.0023, what a hasty sweep leaves."""
    t = times(1.0)
    since = np.maximum(t - START, 0)
    own = tail * np.exp(-0.0023 * 2 * np.pi * 26.3 * since) * np.cos(2 * np.pi * 26.3 * since)
    rng = np.random.default_rng(10)
    state = one(sine(t) + own + 1e-3 * rng.standard_normal(len(t)), 1.0)
    assert abs(state.drift["a"]) > 8 * state.drift_std["a"]
    # A beat of 0.15 turns and a decay by a third make nine tenths of the tail's size, relative to the fundamental.
    envelope = tail / 2.0 * abs(np.exp(2j * np.pi * (26.3 - FREQUENCY) - 0.0023 * 2 * np.pi * 26.3) - 1)
    assert abs(state.drift["a"]) == pytest.approx(envelope, rel=0.15)


@pytest.mark.parametrize("periods", [2.5, 3.0, 3.4, 8.0])
def test_short_measurements_have_a_variance_too(periods):
    seconds = periods / FREQUENCY
    rng, t = np.random.default_rng(12), times(seconds)
    states = [one(sine(t) + 0.1 * rng.standard_normal(len(t)), seconds) for _ in range(40)]
    error = np.mean([abs(state.amplitude["a"][0] - HARMONICS[0]) ** 2 for state in states])
    # A mean of 40 circular errors scatters by a sixth.
    assert 0.5 < np.mean([state.variance["a"][0] for state in states]) / error < 2.0


def test_what_is_too_short_or_has_no_frequency_is_passed_over():
    t = times(1.0)
    assert steady_states(recorded({"a": (sine(t), RATE, 0.0)}, 1.9 / FREQUENCY)) == []
    assert steady_states(recorded({"a": (sine(t), RATE, 0.0)}, 1.0, frequency=0.0)) == []
    hole = sine(t)
    hole[int(START * RATE) : -220] = np.nan
    assert steady_states(recorded({"a": (hole, RATE, 0.0)}, 1.0)) == []
    both = recorded({"a": (sine(t), RATE, 0.0), "b": (hole, RATE, 0.0)}, 1.0)
    assert len(steady_states(both, channels=["a"])) == 1


def hum(t, phase, frequency=50.0, size=0.05):
    return size * np.cos(2 * np.pi * frequency * t + phase)


def test_hum_beside_a_harmonic_is_no_drift_of_the_fundamental():
    t = times(1.0)
    run = recorded({"a": (sine(t) + hum(t, 1.0, size=0.4), RATE, 0.0)}, 1.0)
    ((taken,), (told,)) = steady_states(run), steady_states(run, lines={"a": Line(50.0, 0.4)})
    assert abs(taken.drift["a"]) > 1e-3
    assert abs(told.drift["a"]) < 1e-5
    np.testing.assert_allclose(told.amplitude["a"][:3], HARMONICS, atol=2e-6)


def test_hum_on_a_harmonic_is_that_ones_noise():
    """Four tenths of a line away the two cannot be told apart: whatever the hum's phase, its size is allowed for."""
    omega, t, pulls = 2 * np.pi * 25.2, times(1.0), []
    for phase in np.linspace(0, 2 * np.pi, 16, endpoint=False):
        values = sine(t, omega=omega) + hum(t, phase)
        run = recorded({"a": (values, RATE, 0.0)}, 1.0, frequency=25.2)
        (state,) = steady_states(run, lines={"a": Line(50.0, 0.05)})
        error = state.amplitude["a"][:3] - HARMONICS
        pulls.append(
            np.append(np.abs(error) ** 2 / state.variance["a"][:3], abs(state.drift["a"] / state.drift_std["a"]) ** 2)
        )
    assert state.variance["a"][1] > 0.02**2
    assert np.all(np.mean(pulls, axis=0) < 1.2)
    assert np.mean(pulls, axis=0)[1] > 0.8


def test_two_channels_behind_one_filter_keep_the_ratio_of_harmonics_it_does_not_pass():
    """All of one device; what two devices' filters leave of a harmonic are two numbers."""
    low = 6.5 * FREQUENCY  # its fourth of 6.5 lines lies beyond what the filter passes
    seconds = 26.0 / FREQUENCY
    t = np.arange(int((START + seconds + 0.1) * low)) / low
    values = {"a": sine(t), "b": sine(t, 3.0 * HARMONICS)}
    run = recorded({"a": (values["a"], low, 0.0), "b": (values["b"], low, 0.0)}, seconds)
    assert len(steady_states(run)[0].ratio("b", "a")[0]) == 0
    device = replace(run.devices["a"], values={n: np.asarray(v, np.float32) for n, v in values.items()})
    channels = {n: replace(channel, device="a") for n, channel in run.channels.items()}
    (state,) = steady_states(replace(run, channels=channels, devices={"a": device}))
    ratio, error = state.ratio("b", "a")
    assert len(state.amplitude["a"]) == 2
    np.testing.assert_allclose(ratio[:3], 3.0, rtol=1e-4)
    assert np.all((error[:3] > 0) & (error[:3] < 1e-3))


def test_a_long_step_has_the_same_harmonics_and_noise_from_several_spectra(monkeypatch):
    """A minute of white noise about the sine, a quarter of a second of it lost: whole, and in seven parts."""
    rng = np.random.default_rng(14)
    x = sine(times(60.0)) + 0.1 * rng.standard_normal(len(times(60.0)))
    x[9000:9500] = np.nan
    whole = one(x, 60.0)
    monkeypatch.setattr(sine_fit, "LIMITS", replace(sine_fit.LIMITS, sine_fit_samples=18000))
    parted = one(x, 60.0)
    np.testing.assert_allclose(parted.amplitude["a"], whole.amplitude["a"], rtol=1e-12)
    true = 4 * 0.1**2 / (60.0 * RATE)
    for state in (whole, parted):
        assert np.mean(state.variance["a"]) == pytest.approx(true, rel=0.1)
    np.testing.assert_allclose(parted.drift_std["a"], whole.drift_std["a"], rtol=0.3)
