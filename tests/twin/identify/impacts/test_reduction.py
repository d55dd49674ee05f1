"""Responses of hits: the structure's own at s = j omega + a, whatever the window; and bad windows are named."""

from __future__ import annotations

import numpy as np
import pytest
from hammered import RATIO, SHAPE, NATURAL_Hz, hammered, velocity_per_force

from twin.identify.impacts import Reduction, reduce_hits, sound_hits
from twin.identify.impacts.modes import modes_of_impacts
from twin.identify.modes.shapes import mac_matrix, shape_of


def reduced(band=(20.0, 400.0), how=None, **test):
    hits = sound_hits(hammered(**test), force="force", channels=["v"])
    return reduce_hits(hits, how or Reduction(), band_Hz=band)


@pytest.mark.parametrize("left", [None, 0.01])
def test_responses_are_the_structures_seen_from_beside_the_axis(left):
    found = reduced(how=Reduction(left=left), seconds=2.0)
    s = 2j * np.pi * found.frequency_Hz + found.rate_per_s
    expected = velocity_per_force(s)
    error = np.abs(found.H[:, :, 0] - expected) / np.max(np.abs(expected), axis=0)
    assert np.max(error) < 0.02
    assert np.min(found.coherence[np.abs(found.frequency_Hz - 90) < 2]) > 0.999


@pytest.mark.parametrize("left", [None, 0.3, 0.01])
def test_what_a_window_adds_to_the_damping_comes_off(left):
    fit, _, _ = modes_of_impacts(reduced(how=Reduction(left=left)))
    assert [mode.frequency_Hz for mode in fit.modes] == pytest.approx(NATURAL_Hz, rel=2e-4)
    assert [mode.damping_ratio for mode in fit.modes] == pytest.approx(RATIO, rel=0.02)
    shapes = np.stack([shape_of(mode.residues[:, None]).values for mode in fit.modes], axis=1)
    assert np.diag(mac_matrix(shapes, SHAPE)) == pytest.approx(1.0, abs=1e-3)


def test_h1_bears_noise_of_the_response_h2_noise_of_the_force_and_hv_lies_between():
    def at_resonance(estimator, window_s=None, **noise):
        how = Reduction(estimator=estimator, left=0.3, force_window_s=window_s)
        found = reduced(how=how, points=1, hits=40, **noise)
        near = np.abs(found.frequency_Hz - 60) < 15
        s = 2j * np.pi * found.frequency_Hz[near] + found.rate_per_s
        return np.mean((found.H[near, 0, 0] / velocity_per_force(s)[:, 0]).real)

    noisy = {"response_noise": 2e-3}
    one, two, between = (at_resonance(name, **noisy) for name in ("H1", "H2", "Hv"))
    assert one == pytest.approx(1.0, abs=0.03)
    assert two > 1.1
    assert between == pytest.approx(np.sqrt(one * two), rel=0.1)
    noisy = {"force_noise": 2.0}
    one, two = (at_resonance(name, 0.09, **noisy) for name in ("H1", "H2"))
    assert two == pytest.approx(1.0, abs=0.04)
    assert one < 0.95
    assert at_resonance("H1", **noisy) == pytest.approx(1.0, abs=0.03), "what the window of the pulse leaves out"


def test_windows_that_are_wrong_are_named():
    assert not reduced(seconds=8.0).notes
    cut = reduced(how=Reduction(force_window_s=1e-3)).notes
    assert any(note.startswith("wrong window: the force window of 1 ms cuts the pulse") for note in cut)
    leaks = reduced(how=Reduction(left=1.0), seconds=0.7).notes
    assert any("without an exponential window" in note and "record longer" in note for note in leaks)
    drowned = modes_of_impacts(reduced(how=Reduction(left=1e-8)))[2]
    assert any("times the damping" in note for note in drowned)
    taken = reduced(seconds=0.7)
    assert taken.rate_per_s > 0
    assert any("exponential window to" in note for note in taken.notes)


def test_one_hit_has_no_coherence_and_that_is_said():
    assert any("one hit has no coherence" in note for note in reduced(hits=1, seconds=8.0).notes)
