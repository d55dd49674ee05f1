"""What changes a rig by itself leaves lines that keep their distance to the drive; nothing else does."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.signals import find_sidebands, loudest_Hz
from twin.identify.spectra.sine_fit import Line, steady_states

CHANNELS = ("acc1", "acc2")


def changed(synthetic, seed, factor):
    """A sweep whose first accelerometer shows a motion times a function of time (n,)."""
    samples = synthetic.stepped_sine(seed)
    t = np.arange(len(samples["acc1"])) / synthetic.rate_Hz
    return synthetic.run(synthetic.converted({**samples, "acc1": samples["acc1"] * factor(t)}))


@pytest.mark.parametrize("offset_Hz", [3.0, 7.2])
def test_a_modulation_is_found_at_its_frequency(synthetic, offset_Hz):
    run = changed(synthetic, 7, lambda t: 1 + 0.02 * np.cos(2 * np.pi * offset_Hz * t))
    found = find_sidebands([run], CHANNELS, {})
    assert found is not None
    assert found.channel == "acc1"
    assert found.offset_Hz == pytest.approx(offset_Hz, abs=0.3)
    assert f"{found.offset_Hz:.3g} Hz beside" in found.told


def test_a_subharmonic_follows_the_drive(synthetic):
    samples = synthetic.stepped_sine(8)
    length = round(synthetic.rate_Hz)
    t = np.arange(length) / synthetic.rate_Hz
    half = np.concatenate([np.cos(np.pi * f * t) for f in synthetic.frequencies_Hz])
    run = synthetic.run({**samples, "acc2": samples["acc2"] + synthetic.noise["acc2"] * half})
    found = find_sidebands([run], CHANNELS, {})
    assert found is not None
    assert found.channel == "acc2"
    assert found.offset_Hz == pytest.approx(np.median(synthetic.frequencies_Hz) / 2)


def test_a_rig_that_still_rings_at_its_own_frequency_is_unsettled_and_not_changed(synthetic):
    """All steps of a sweep were measured too soon; what is told of them is the dwell."""
    samples = synthetic.stepped_sine(14)
    length = round(synthetic.rate_Hz)
    t = np.arange(length) / synthetic.rate_Hz
    own_Hz = np.median(synthetic.frequencies_Hz) + 0.3
    ringing = 30 * synthetic.noise["acc1"] * np.exp(-1.5 * t) * np.cos(2 * np.pi * own_Hz * t)
    run = synthetic.run({**samples, "acc1": samples["acc1"] + np.tile(ringing, len(synthetic.frequencies_Hz))})
    states = steady_states(run)
    assert find_sidebands([run], CHANNELS, {}) is not None
    assert find_sidebands([run], CHANNELS, {}, unsettled=states) is None


def test_where_the_responses_are_largest_the_rig_rings_a_little_in_every_step(synthetic):
    apart = np.linspace(2.2, 2.6, 8)
    wide = np.concatenate([26.4 - apart[::-1], [26.4], 26.4 + apart])
    samples = synthetic.stepped_sine(15, frequencies_Hz=wide)
    t = np.arange(round(synthetic.rate_Hz)) / synthetic.rate_Hz
    states = steady_states(synthetic.run(samples, wide))
    loudest = loudest_Hz(states, CHANNELS, force="force")
    (own_Hz,) = loudest.values()
    largest = max(states, key=lambda state: abs(state.amplitude["acc1"][0] / state.amplitude["force"][0]))
    assert own_Hz == largest.frequency_Hz
    rng = np.random.default_rng(15)
    angles = rng.uniform(0, 2 * np.pi, len(states))
    ringing = [0.3 * synthetic.noise["acc1"] * np.exp(-t) * np.cos(2 * np.pi * own_Hz * t + angle) for angle in angles]
    run = synthetic.run({**samples, "acc1": samples["acc1"] + np.concatenate(ringing)}, wide)
    assert find_sidebands([run], CHANNELS, {}) is not None
    assert find_sidebands([run], CHANNELS, {}, resonance_Hz=loudest) is None


def test_a_slow_drive_leaves_little_room_for_lines_and_says_nothing(synthetic):
    slow = np.linspace(9.5, 10.5, 16)
    assert (
        find_sidebands(
            [synthetic.run(synthetic.stepped_sine(13, frequencies_Hz=slow, step_s=0.5), slow, step_s=0.5)], CHANNELS, {}
        )
        is None
    )


def test_sound_sweeps_hum_and_drift_have_none(synthetic, clean_runs):
    for run, noise in clean_runs:
        assert find_sidebands([noise, run], CHANNELS, {}) is None
    assert find_sidebands([changed(synthetic, 9, lambda t: 1 + 0.01 * t / t[-1])], CHANNELS, {}) is None
    # What is left of each step's transient dies within it.
    assert find_sidebands([changed(synthetic, 11, lambda t: 1 + 0.2 * np.exp(-3.0 * (t % 1.0)))], CHANNELS, {}) is None
    # The noise of an instrument that is larger at low frequencies.
    samples = synthetic.stepped_sine(12)
    slow = np.convolve(np.random.default_rng(12).standard_normal(len(samples["acc1"])), np.exp(-np.arange(400) / 40.0))
    coloured = {**samples, "acc1": samples["acc1"] + 0.3 * synthetic.noise["acc1"] * slow[: len(samples["acc1"])]}
    assert find_sidebands([synthetic.run(coloured)], CHANNELS, {}) is None
    samples = synthetic.stepped_sine(10)
    t = np.arange(len(samples["acc1"])) / synthetic.rate_Hz
    hum = 10 * synthetic.noise["acc1"] * np.cos(2 * np.pi * 50.0 * t)
    humming = synthetic.run({**samples, "acc1": samples["acc1"] + hum})
    assert find_sidebands([humming], CHANNELS, {"acc1": Line(50.0, 10 * synthetic.noise["acc1"])}) is None
