"""Broadband responses that were cut off or torn, filled in by what the force makes of them."""

from dataclasses import replace

import numpy as np
import pytest

from twin.identify.spectra.driven_gaps import driven_through
from twin.identify.spectra.gaps import fill_gaps
from twin.identify.spectra.spectrum import BroadbandRecord

RATE_Hz = 2048
COUNT = 16 * RATE_Hz
MODES = ((28.0, 0.003, 1.0), (170.0, 0.005, 3.0))


def response(omega, *, stiffer=1.0):
    """Of a channel that is later than the force by nothing; and of one that is the same upside down."""
    H = sum(
        size * omega_r**2 / (omega_r**2 - omega**2 + 2j * zeta * omega_r * omega)
        for omega_r, zeta, size in ((2 * np.pi * f * stiffer, zeta, size) for f, zeta, size in MODES)
    )
    return np.stack([H, -H], axis=1)


@pytest.fixture(scope="module")
def record():
    """Sixteen seconds of noise from 5 to 400 Hz, the second channel sampled a third of an interval late."""
    rng = np.random.default_rng(8)
    frequency = np.fft.rfftfreq(COUNT, 1 / RATE_Hz)
    U = np.where((frequency > 5) & (frequency < 400), np.fft.rfft(rng.standard_normal(COUNT)), 0.0)
    late = 0.3 / RATE_Hz
    H = response(2 * np.pi * frequency)
    samples = {
        "force": np.fft.irfft(U, COUNT),
        "acc1": np.fft.irfft(H[:, 0] * U, COUNT),
        "acc2": np.fft.irfft(H[:, 1] * U * np.exp(2j * np.pi * frequency * late), COUNT),
    }
    return BroadbandRecord(
        run="a run", sweep="noise", time_s=8.0, sample_rate_Hz=RATE_Hz, samples=samples, late_s={"acc2": late}
    )


def torn(record, channel, where):
    """The record without the samples of one channel there, as it is read."""
    x = record.samples[channel].copy()
    x[where] = np.nan
    samples, missing = {**record.samples, channel: fill_gaps(x)}, {channel: np.flatnonzero(where)}
    return replace(record, samples=samples, missing=missing)


def gain_error(record, true, channel):
    x, y = true.samples[channel], record.samples[channel]
    return float(y @ x / (x @ x) - 1)


@pytest.mark.parametrize("channel", ["acc1", "acc2"])
@pytest.mark.parametrize("stiffer", [1.0, 1.001])
def test_what_was_clipped_goes_on_beyond_the_limit(record, channel, stiffer):
    """A fifth is cut off, and what the signal itself predicts is too small."""
    x = record.samples[channel]
    cut = np.abs(x) > np.quantile(np.abs(x), 0.8)
    clipped = torn(record, channel, cut)
    filled = driven_through(
        clipped,
        lambda omega: response(omega, stiffer=stiffer),
        force="force",
        channels=("acc1", "acc2"),
        up_to_Hz=400.0,
    )
    by_itself, by_force = (gain_error(each, record, channel) for each in (clipped, filled))
    assert by_itself < -0.005
    assert abs(by_force) < (1e-4 if stiffer == 1.0 else 0.3) * abs(by_itself)
    np.testing.assert_array_equal(filled.samples[channel][~cut], clipped.samples[channel][~cut])


def test_a_record_without_gaps_is_left_alone(record):
    assert driven_through(record, response, force="force", channels=("acc1", "acc2"), up_to_Hz=400.0) is record
