"""A thinner copy of the evidence keeps what it says: fewer witnesses, the same story."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from recordings import read_run
from twin.diagnose.thinned_data import thinned_data
from twin.identify.base_fit import starting_baseline
from twin.identify.harmonics import harmonic_residuals
from twin.identify.measured_data import gather_data
from twin.identify.residual_model import ResidualModel
from twin.rigs import load_rig


@pytest.fixture(scope="module")
def evidence(campaign):
    return gather_data(
        [read_run(campaign / f"{name}.mcap") for name in ("random", "sweeps")], load_rig("steel-lap-joint")
    )


@pytest.fixture(scope="module")
def baseline(evidence):
    return starting_baseline(evidence)


@pytest.fixture(scope="module")
def thinned(evidence, baseline):
    harmonics = harmonic_residuals(ResidualModel(evidence), baseline)
    return harmonics, *thinned_data(evidence, harmonics, bins=40, steps=15)


def test_about_as_much_is_kept_as_was_asked_for(evidence, thinned):
    _, thinner, harmonics = thinned
    assert 30 <= len(thinner.broadband[0].frequency_Hz) <= 60 < len(evidence.broadband[0].frequency_Hz)
    assert 10 <= len(thinner.steps) <= 23 < len(evidence.steps)
    assert len(harmonics.residual) == len(thinner.steps) == len(thinner.steps.states)


def test_everything_kept_is_as_it_was_measured(evidence, thinned):
    whole, thinner, harmonics = thinned
    (data,), (kept,) = evidence.broadband, thinner.broadband
    bins = np.searchsorted(data.frequency_Hz, kept.frequency_Hz)
    assert np.array_equal(data.frequency_Hz[bins], kept.frequency_Hz)
    assert np.array_equal(data.H[bins], kept.H)
    assert np.array_equal(data.relative_covariance[bins], kept.relative_covariance)
    steps = [evidence.steps.states.index(state) for state in thinner.steps.states]
    assert np.array_equal(evidence.steps.response[steps], thinner.steps.response)
    assert np.array_equal(evidence.steps.force[steps], thinner.steps.force)
    assert np.array_equal(evidence.steps.time_s[steps], thinner.steps.time_s)
    assert np.array_equal(whole.residual[steps], harmonics.residual)


def test_what_is_kept_is_spread_over_all_that_was_measured(evidence, thinned):
    """Every sweep, both ends of the band, and no gap much wider than the others."""
    _, thinner, _ = thinned
    assert {state.sweep for state in thinner.steps.states} == {state.sweep for state in evidence.steps.states}
    bins = np.flatnonzero(np.isin(evidence.broadband[0].frequency_Hz, thinner.broadband[0].frequency_Hz))
    assert np.all(np.diff(bins) == np.diff(bins)[0])
    assert bins[0] < np.diff(bins)[0]
    assert bins[-1] + np.diff(bins)[0] >= len(evidence.broadband[0].frequency_Hz) - 1


def test_a_model_misses_it_by_as_much_for_each_datum(evidence, thinned, baseline):
    """Of a model whose E' is off by a twentieth: the same mean square, but for the luck of the draw."""
    _, thinner, _ = thinned
    vector = baseline.vector
    vector[0] += 0.05
    off = baseline.with_vector(vector)
    whole, thin = (ResidualModel(e).evaluate(off, sensitivities=False) for e in (evidence, thinner))
    for (name, all_of_it), (_, part) in zip(whole.blocks, thin.blocks, strict=True):
        squares = [np.mean(p.residual[where] ** 2) for p, where in ((whole, all_of_it), (thin, part))]
        assert squares[0] > 4, name
        assert squares[1] == pytest.approx(squares[0], rel=0.5), name


def test_little_evidence_is_kept_whole(evidence):
    kept, harmonics = thinned_data(evidence, None, bins=10_000, steps=10_000)
    assert harmonics is None
    assert np.array_equal(kept.broadband[0].H, evidence.broadband[0].H)
    assert kept.steps.states == evidence.steps.states


def test_neither_steps_nor_bins_are_needed(evidence):
    no_steps = evidence.steps.select(np.zeros(len(evidence.steps), bool))
    only_bins, _ = thinned_data(replace(evidence, steps=no_steps), None)
    assert len(only_bins.steps) == 0
    only_steps, _ = thinned_data(replace(evidence, broadband=()), None)
    assert only_steps.broadband == ()
