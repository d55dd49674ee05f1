"""Samples that were lost, filled in from what the rest of the signal predicts."""

import numpy as np
import pytest
from scipy import signal

from twin.identify.limits import LIMITS
from twin.identify.spectra.gaps import fill_gaps

RATE_Hz = 5120
N = 20 * RATE_Hz


def resonances(rng):
    """Two lightly damped modes under noise."""
    force = rng.standard_normal(N)
    x = np.zeros(N)
    for frequency, zeta, size in ((28.0, 0.003, 1.0), (170.0, 0.003, 3.0)):
        s = 2 * np.pi * frequency / RATE_Hz
        pole = np.exp(s * (-zeta + 1j * np.sqrt(1 - zeta**2)))
        x += size * signal.lfilter([s], [1, -2 * pole.real, abs(pole) ** 2], force)
    return force, x


def holes(x, rng, *, count=20, length=102):
    """`x` without that many stretches of 20 ms."""
    torn = x.copy()
    for start in rng.integers(0, len(x) - length, count):
        torn[start : start + length] = np.nan
    return torn


def straight(torn):
    """Lines across the gaps."""
    lost = np.isnan(torn)
    out = torn.copy()
    out[lost] = np.interp(np.flatnonzero(lost), np.flatnonzero(~lost), torn[~lost])
    return out


def test_decaying_modes_are_continued_across_a_gap():
    t = np.arange(4 * RATE_Hz) / RATE_Hz
    x = np.exp(-t) * np.cos(2 * np.pi * 28 * t) + 0.3 * np.exp(-2 * t) * np.sin(2 * np.pi * 170 * t)
    torn = x.copy()
    torn[5000:5102] = torn[9000:9004] = np.nan
    lost = np.isnan(torn)
    filled, line = (np.max(np.abs(y - x)[lost]) for y in (fill_gaps(torn), straight(torn)))
    assert filled < 0.01 * line


def test_a_gain_read_off_a_torn_channel_is_not_small_by_the_share_that_is_lost():
    """Two per cent are lost, and lines across the gaps take as much off the response."""
    rng = np.random.default_rng(5)
    _, x = resonances(rng)
    torn = holes(x, rng)
    lost = np.isnan(torn).mean()
    assert 0.015 < lost < 0.025

    def gain(y):
        return (y @ x) / (x @ x) - 1

    assert gain(straight(torn)) < -0.8 * lost
    assert abs(gain(fill_gaps(torn))) < 0.25 * lost


def test_what_was_received_stays_as_it_was():
    rng = np.random.default_rng(6)
    _, x = resonances(rng)
    torn = holes(x, rng)
    sound = np.isfinite(torn)
    np.testing.assert_array_equal(fill_gaps(torn)[sound], x[sound])
    assert fill_gaps(x) is x


@pytest.mark.parametrize("where", [slice(0, 50), slice(-50, None), slice(0, -3), slice(100, 5000)])
def test_gaps_at_the_ends_and_long_ones_stay_within_reason(where):
    _, x = resonances(np.random.default_rng(7))
    torn = x[:8000].copy()
    torn[where] = np.nan
    filled = fill_gaps(torn)
    assert np.all(np.isfinite(filled))
    assert np.max(np.abs(filled)) < 3 * np.max(np.abs(x))


@pytest.mark.parametrize("x", [np.full(500, 2.0), np.arange(3.0), np.arange(2 * LIMITS.gaps_order, dtype=float)])
def test_signals_that_predict_nothing(x):
    torn = np.append(x, [np.nan, x[-1]])
    filled = fill_gaps(torn)
    assert filled[-2] == pytest.approx(x[-1], rel=0.1)
