"""A channel that stands still while it should move is seen, sample by sample; quiet and dead channels are not."""

from __future__ import annotations

import numpy as np
import pytest

from twin.causes.lost_samples.finding import find_lost_samples

STRETCHES = ((3000, 100), (9000, 6), (20_000, 512))
"""Where the last value is repeated, and how often."""


@pytest.fixture
def held(synthetic):
    """A sweep with an accelerometer whose driver fills gaps with the value before them."""
    samples = synthetic.converted(synthetic.stepped_sine(31))
    for first, count in STRETCHES:
        samples["acc1"][first : first + count] = samples["acc1"][first - 1]
    return samples


def test_every_repeated_sample_is_found_and_no_other(synthetic, held):
    (finding,) = find_lost_samples([synthetic.run(held, path="a.mcap")])
    assert finding.cause == "lost-samples"
    assert finding.names == {"channel": "acc1"}
    expected = [k for first, count in STRETCHES for k in range(first, first + count)]
    assert finding.spoilt["a.mcap"].tolist() == expected


def test_samples_that_never_came_are_told(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(32))
    samples["acc2"][500:750] = np.nan
    (finding,) = find_lost_samples([synthetic.run(samples)])
    assert finding.names == {"channel": "acc2"}
    assert "250 are missing" in finding.summary
    assert not finding.spoilt


def test_whole_signals_are_no_alarm(clean_runs):
    for runs in clean_runs:
        assert find_lost_samples(runs) == []


def test_a_channel_in_its_own_converters_steps_has_lost_nothing(synthetic):
    """A sensor with nothing to measure takes a few levels only, often the same one many times over."""
    samples = synthetic.converted(synthetic.stepped_sine(33))
    rng = np.random.default_rng(33)
    samples["acc1"] = np.round(0.4 * rng.standard_normal(len(samples["acc1"]))) * 0.015
    assert find_lost_samples([synthetic.run(samples)]) == []


def test_a_dead_channel_has_lost_nothing(synthetic):
    samples = synthetic.converted(synthetic.stepped_sine(34))
    assert find_lost_samples([synthetic.run(samples | {"acc1": 0 * samples["acc1"]})]) == []
