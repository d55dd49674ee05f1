"""The closed form of a one-sided contact against a Fourier transform and against what it becomes in limits."""

from __future__ import annotations

import numpy as np
import pytest

from twin.diagnose.one_sided import one_sided_harmonics


def transformed(amplitude, gap, count):
    """Coefficients 1 ... count of the sampled overshoot."""
    t = 2 * np.pi * np.arange(1 << 14) / (1 << 14)
    force = np.maximum(np.asarray(amplitude)[:, None] * np.cos(t) - gap, 0.0)
    return 2 * np.fft.rfft(force)[:, 1 : count + 1] / len(t)


@pytest.mark.parametrize("gap", [0.9, 0.0, -0.4])
def test_overshoot_has_the_coefficients_of_its_samples(gap):
    """Also for a contact that is closed at rest, which a negative gap is."""
    amplitude = np.array([0.5, 1.0, 1.7, 6.0])
    assert one_sided_harmonics(amplitude, gap, 6) == pytest.approx(transformed(amplitude, gap, 6), abs=1e-6)


def test_motion_that_does_not_reach_the_gap_has_no_harmonics():
    assert np.max(np.abs(one_sided_harmonics(np.array([0.0, 0.3, 0.9]), 0.9, 6))) < 1e-15


def test_contact_all_the_time_is_a_plain_spring():
    found = one_sided_harmonics(np.array([0.5]), -0.6, 5)[0]
    assert found == pytest.approx([0.5, 0, 0, 0, 0], abs=1e-15)
