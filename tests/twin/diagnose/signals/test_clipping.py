"""Peaks cut off are seen, at the value they are cut at; loud signals that are whole are not."""

from __future__ import annotations

import numpy as np
import pytest

from twin.causes.clipping.finding import find_clipping

LIMIT = 9.0


@pytest.fixture
def cut(synthetic):
    """A sweep whose second accelerometer limits, as the resonance is passed."""
    samples = synthetic.converted(synthetic.stepped_sine(21))
    return samples | {"acc2": np.clip(samples["acc2"], -LIMIT, LIMIT)}


def test_a_channel_that_limits_is_named_with_its_limit(synthetic, cut):
    (finding,) = find_clipping([synthetic.run(cut)])
    assert finding.cause == "clipping"
    assert finding.names == {"channel": "acc2"}
    assert finding.values["limit"] == pytest.approx(LIMIT, rel=1e-4)
    assert f"{LIMIT:g}" in finding.summary


def test_samples_on_the_limit_and_beside_it_are_spoilt_and_no_others(synthetic, cut):
    (finding,) = find_clipping([synthetic.run(cut, path="a.mcap")])
    on_the_limit = np.abs(cut["acc2"]) >= LIMIT * (1 - 1e-6)
    # The converter's filter mixes a cut with its neighbours.
    near = np.convolve(on_the_limit, np.ones(5), mode="same") > 0
    assert finding.spoilt["a.mcap"].tolist() == np.flatnonzero(near).tolist()


def test_the_run_that_limits_is_the_one_that_is_spoilt(synthetic, cut):
    quiet = synthetic.run(synthetic.converted(synthetic.stepped_sine(22)), path="quiet.mcap")
    (finding,) = find_clipping([quiet, synthetic.run(cut, path="loud.mcap")])
    assert set(finding.spoilt) == {"loud.mcap"}


def test_peaks_cut_too_narrowly_to_be_judged_are_spoilt_with_the_others(synthetic):
    """An amplifier's limit carries the converter's noise; steps that just reach it look round."""
    samples = synthetic.converted(synthetic.stepped_sine(21))
    whole, limit = samples["acc2"], 0.3 * np.max(np.abs(samples["acc2"]))
    rng = np.random.default_rng(25)
    noisy = np.clip(whole, -limit, limit) + 2e-4 * limit * rng.standard_normal(len(whole))
    (finding,) = find_clipping([synthetic.run(samples | {"acc2": noisy}, path="a.mcap")])
    missed = np.setdiff1d(np.flatnonzero(np.abs(whole) > 1.001 * limit), finding.spoilt["a.mcap"])
    assert len(missed) == 0


def test_whole_signals_are_no_alarm(clean_runs):
    for runs in clean_runs:
        assert find_clipping(runs) == []


def test_a_dead_channel_is_not_one_that_limits(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(23))
    assert find_clipping([synthetic.run(samples | {"acc1": 0 * samples["acc1"]})]) == []


def test_a_few_knocks_on_the_limit_are_not_clipping(synthetic):
    """Single samples that reach it do not follow one another."""
    samples = synthetic.converted(synthetic.stepped_sine(24))
    samples["acc1"][1000::2000] = synthetic.ranges["acc1"]
    assert find_clipping([synthetic.run(samples)]) == []


def test_peaks_that_a_third_harmonic_flattens_each_at_its_own_height_are_not_cut(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(26))
    t = np.arange(len(samples["acc2"])) / synthetic.rate_Hz
    theta = 2 * np.pi * 26.0 * t
    growing = 100.0 + 3.0 * t / t[-1]
    flattened = growing * (np.cos(theta) - 0.13 * np.cos(3 * theta))
    assert find_clipping([synthetic.run(samples | {"acc2": flattened})]) == []
    (finding,) = find_clipping([synthetic.run(samples | {"acc2": np.clip(flattened, -89.0, 89.0)})])
    assert finding.values["limit"] == pytest.approx(89.0, rel=1e-3)


def test_peaks_that_harmonics_near_a_resonance_flatten_to_one_side_are_not_cut(synthetic):
    """Of one height all, as a steady dwell has them."""
    samples = synthetic.converted(synthetic.stepped_sine(27))
    theta = 2 * np.pi * 26.0 * np.arange(len(samples["acc2"])) / synthetic.rate_Hz
    leaning = 100.0 * (np.cos(theta) - 0.125 * np.cos(3 * theta) + 0.005 * np.sin(4 * theta))
    assert find_clipping([synthetic.run(samples | {"acc2": leaning})]) == []


@pytest.mark.parametrize(("third", "noise"), [(0.12, 1e-5), (0.111, 3e-4)])
def test_tops_with_a_shape_of_their_own_period_by_period_on_one_step_are_not_cut(synthetic, third, noise):
    """Of one height all, and flat to a thousandth or two: their samples differ by more than noise lets their means."""
    frequency_Hz, rng = synthetic.rate_Hz / 39.4, np.random.default_rng(31)
    samples = synthetic.converted(synthetic.stepped_sine(30, frequencies_Hz=[frequency_Hz], step_s=4.0))
    theta = 2 * np.pi * np.arange(len(samples["acc2"])) / 39.4
    resting = 100.0 * (np.cos(theta) - third * np.cos(3 * theta))
    carried = 100.0 * noise * rng.standard_normal(len(theta))

    def found(x):
        return find_clipping([synthetic.run(samples | {"acc2": x + carried}, [frequency_Hz], step_s=4.0)])

    assert found(resting) == []
    limit = 0.95 * np.max(resting)
    (finding,) = found(np.clip(resting, -limit, limit))
    assert finding.values["limit"] == pytest.approx(limit, rel=2e-3)


def test_flat_tops_of_one_step_alone_are_its_harmonics(synthetic):
    """A limit would show beside the resonance as well: at the steps before and after, all above it without it."""
    samples = synthetic.converted(synthetic.stepped_sine(28))
    whole, length = samples["acc2"], len(samples["acc2"]) // 16
    rng = np.random.default_rng(29)
    limit = 0.5 * np.max(np.abs(whole))
    flat = np.clip(whole, -limit, limit) + 1e-4 * limit * rng.standard_normal(len(whole))
    loudest = int(np.argmax(np.abs(whole))) // length
    outside = np.ones(len(whole), bool)
    outside[loudest * length : (loudest + 1) * length] = False
    one_step = np.where(outside, 0.4 * whole, flat)
    assert find_clipping([synthetic.run(samples | {"acc2": one_step})]) == []
    assert find_clipping([synthetic.run(samples | {"acc2": flat})])


@pytest.mark.parametrize("noise", [1e-5, 3e-4, 2e-3])
def test_a_limit_that_carries_noise_is_one(synthetic, noise):
    samples = synthetic.converted(synthetic.stepped_sine(28))
    limit = 0.5 * np.max(np.abs(samples["acc2"]))
    rng = np.random.default_rng(29)
    noisy = np.clip(samples["acc2"], -limit, limit) + noise * limit * rng.standard_normal(len(samples["acc2"]))
    (finding,) = find_clipping([synthetic.run(samples | {"acc2": noisy})])
    assert finding.values["limit"] == pytest.approx(limit, rel=2e-3)
