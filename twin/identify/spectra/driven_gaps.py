"""Missing samples of a broadband response filled in by what the measured force makes of them.

Where a response was clipped, just its largest samples are missing, one gap after another: nothing of the signal itself
predicts that it went on beyond the limit.  The force does.  A reference model's response to it takes most of the motion
off; what that leaves is small, and predicts its own gaps (:mod:`twin.identify.spectra.gaps`) as well as needs be.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from twin.arrays import Array
from twin.identify.spectra.gaps import fill_gaps
from twin.identify.spectra.spectrum import BroadbandRecord


def driven_through(
    record: BroadbandRecord, response: Callable[[Array], Array], *, force: str, channels: Sequence[str], up_to_Hz: float
) -> BroadbandRecord:
    """The record with what `channels` missed filled in anew.

    Parameters
    ----------
    response
        Responses (f, o) of `channels` per force at given omega.
    up_to_Hz
        Frequency up to which the response is known; the force's part above is left to the signal itself.
    """
    torn = [channel for channel in channels if channel in record.missing]
    if not torn:
        return record
    samples = dict(record.samples)
    count = len(samples[force])
    frequency = np.fft.rfftfreq(count, 1 / record.sample_rate_Hz)
    known = (frequency > 0) & (frequency <= up_to_Hz)
    omega = 2 * np.pi * frequency[known]
    Y = response(omega) * np.fft.rfft(samples[force])[known, None]
    for channel in torn:
        spectrum = np.zeros(len(frequency), complex)
        late_s = record.late_s.get(channel, 0.0) - record.late_s.get(force, 0.0)
        spectrum[known] = Y[:, channels.index(channel)] * np.exp(1j * omega * late_s)
        driven = np.fft.irfft(spectrum, count)
        rest = samples[channel] - driven
        gaps = record.missing[channel]
        rest[gaps] = np.nan
        samples[channel] = samples[channel].copy()
        samples[channel][gaps] = (driven + fill_gaps(rest))[gaps]
    return replace(record, samples=samples)
