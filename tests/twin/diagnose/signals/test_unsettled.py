"""Sweeps measured before they settled are seen in the fits' own drifts; settled ones, and single jumps, are not."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.signals import find_unsettled
from twin.identify.spectra.sine_fit import steady_states

NATURAL_Hz, DECAY_per_s = 26.4, 0.35
"""Of the mode that rings on: it needs three seconds for each e-fold."""


def ringing(synthetic, seed, steps, size):
    """A sweep in which some steps begin with a free vibration of a relative size that dies away."""
    samples = synthetic.stepped_sine(seed)
    length = len(samples["acc1"]) // len(synthetic.frequencies_Hz)
    t = np.arange(length) / synthetic.rate_Hz
    decay = np.exp(-DECAY_per_s * t) * np.cos(2 * np.pi * NATURAL_Hz * t)
    for k in steps:
        own = slice(k * length, (k + 1) * length)
        for name in ("acc1", "acc2"):
            samples[name][own] += size * np.sqrt(2) * np.std(samples[name][own]) * decay
    return synthetic.run(synthetic.converted(samples))


def test_a_sweep_that_still_rings_is_named(synthetic):
    (finding,) = find_unsettled(steady_states(ringing(synthetic, 71, range(16), 0.1)), force="force")
    assert finding.cause == "unsettled-dwell"
    assert finding.names == {"sweep": "up"}
    assert "of 16 steps" in finding.summary


def test_settled_sweeps_are_no_alarm(clean_runs):
    for sines, _ in clean_runs:
        assert find_unsettled(steady_states(sines), force="force") == []


def test_a_jump_in_a_few_steps_is_not_the_sweeps_fault(synthetic):
    assert find_unsettled(steady_states(ringing(synthetic, 72, (7, 8, 9), 0.1)), force="force") == []


def test_what_has_died_away_to_a_part_in_ten_thousand_is_settled(synthetic):
    assert find_unsettled(steady_states(ringing(synthetic, 73, range(16), 1e-4)), force="force") == []


@pytest.mark.parametrize("steps", [4, 7])
def test_a_handful_of_steps_is_too_few_to_tell(synthetic, steps):
    states = steady_states(ringing(synthetic, 74, range(16), 0.1))
    assert find_unsettled(states[:steps], force="force") == []


def test_a_clock_that_runs_fast_unsettles_nothing(synthetic):
    """All channels turn by the same phase within each step: by a third of a radian here."""
    samples = synthetic.stepped_sine(75)
    t = np.arange(len(samples["acc1"])) / synthetic.rate_Hz
    late = {name: np.interp(t * (1 + 1.5e-3), t, values) for name, values in samples.items()}
    states = steady_states(synthetic.run(synthetic.converted(late)))
    assert max(abs(state.drift["acc1"]) for state in states) > 0.05
    assert find_unsettled(states, force="force") == []
