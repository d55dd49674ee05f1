"""The converter's decimation filter: linear phase, from internal to output rate, with each channel's delay.

A windowed sinc of +-12 output samples, flat to 0.4 of the output rate and 80 dB down from 0.6.  A delay that is no
whole number of steps only moves the sinc's centre.  The filter's own delay of 12 samples is the same for all
channels, as in a sigma-delta converter, and no time stamp shows it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from twin.joint.kernel import COMPILED

__all__ = ["HALF_LENGTH", "decimate", "decimation_taps"]

HALF_LENGTH = 12
"""Output samples on either side of the filter's centre."""
BETA = 7.86
"""Kaiser window for 80 dB."""


def decimation_taps(substeps: int, delay_steps: NDArray[np.float64]) -> NDArray[np.float64]:
    """Filter of each channel, (channels, taps), newest internal sample last.

    Parameters
    ----------
    substeps
        Internal steps an output sample.  With one there is nothing to decimate, and the filter only delays.
    delay_steps : ndarray, (channels,)
        Delay of each channel in internal steps.
    """
    reach = HALF_LENGTH * substeps
    # Latency of the sample k places before the newest is k; the centre sits at `reach`, plus the delay.
    latency = np.arange(2 * reach + 1 + int(np.ceil(delay_steps.max(initial=0.0))))[::-1]
    x = (latency[None, :] - reach - delay_steps[:, None]) / substeps
    window = np.i0(BETA * np.sqrt(np.maximum(0.0, 1 - (x / HALF_LENGTH) ** 2))) / np.i0(BETA)
    taps = np.sinc(x) * window * (np.abs(x) <= HALF_LENGTH)
    return np.ascontiguousarray(taps / taps.sum(axis=1, keepdims=True))


@COMPILED
def decimate(internal: NDArray[np.float64], taps: NDArray[np.float64], substeps: int, out: NDArray[np.float64]) -> None:
    """Filter and keep every `substeps`-th sample.

    Parameters
    ----------
    internal : ndarray, (channels, taps - 1 + count * substeps)
        History, then new samples.
    taps : ndarray, (channels, taps)
        See :func:`decimation_taps`.
    out : ndarray, (channels, count)
        Filled.
    """
    length = taps.shape[1]
    for c in range(taps.shape[0]):
        for n in range(out.shape[1]):
            start = (n + 1) * substeps - 1
            total = 0.0
            for k in range(length):
                total += taps[c, k] * internal[c, start + k]
            out[c, n] = total
