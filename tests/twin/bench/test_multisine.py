"""The multisine's samples against the sum of sines that it is, and what periodic means."""

from __future__ import annotations

import numpy as np
import pytest

from twin.bench.generator import PeriodicSignal

PERIOD_s, BAND_Hz, STEP_s = 0.5, (20.0, 400.0), 1 / 3000.7


def test_it_is_the_sum_of_its_sines_however_it_is_cut_into_blocks():
    source = PeriodicSignal(period_s=PERIOD_s, band_Hz=BAND_Hz, seed=4, step_s=STEP_s)
    values = np.concatenate([source.samples(count) for count in (700, 1, 0, 700, 5000)])
    order = np.arange(10, 201)  # 20 Hz to 400 Hz in steps of 2 Hz, both ends included
    phase = np.random.default_rng(4).uniform(0, 2 * np.pi, len(order))
    at = np.arange(0, len(values), 37)
    sines = np.cos(2 * np.pi * order * (at * STEP_s / PERIOD_s)[:, None] + phase)
    assert values[at] == pytest.approx(np.sqrt(2 / len(order)) * sines.sum(axis=1), abs=1e-7)


def test_its_rms_is_one_and_other_seeds_have_other_phases():
    first, second = (
        PeriodicSignal(period_s=1.0, band_Hz=BAND_Hz, seed=seed, step_s=1 / 4096).samples(4096) for seed in (1, 2)
    )
    assert np.std(first) == pytest.approx(1.0, rel=1e-9)
    assert abs(np.mean(first * second)) < 0.3


def test_a_band_without_lines_is_refused():
    with pytest.raises(ValueError, match="no line"):
        PeriodicSignal(period_s=0.1, band_Hz=(11.0, 19.0), seed=0, step_s=STEP_s)
