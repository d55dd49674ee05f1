"""The converter's decimation filter: linear phase, from internal to output rate, with each channel's delay.

A windowed sinc of +-12 output samples, flat to 0.4 of the output rate and 80 dB down from 0.6.  A delay that is no
whole number of steps only moves the sinc's centre.  The filter's own delay of 12 samples is the same for all
channels, as in a sigma-delta converter, and no time stamp shows it.

Accelerations come from velocities here: a joint force that is straight between steps has kinks, whose images the
sampled acceleration of a stiff mode would fold onto the harmonics (4 % of the third at 8 kHz), and the velocity, being
smoother, does not.
"""

import numpy as np

from twin.arrays import Array
from twin.bench.limits import LIMITS
from twin.joint.kernel import COMPILED

DIFFERENCE = np.convolve([1.0, -1.0], [-1 / 24, 13 / 12, -1 / 24])
"""Difference of neighbours times the step, its droop sinc(f h) made good; centred 1.5 steps back."""
FIVE_POINTS = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / 12
"""Central difference for the case in which there is nothing to filter: 0.5 % low at a tenth of the rate."""


def decimation_taps(substeps: int, delay_steps: Array, *, differentiate: Array, step_s: float) -> Array:
    """Filter of each channel, (channels, taps), newest internal sample last.

    Parameters
    ----------
    substeps
        Internal steps an output sample.  With one there is nothing to decimate: the filter only delays and
        differentiates, and is short where no channel has a delay of its own.
    delay_steps : ndarray, (channels,)
        Delay of each channel in internal steps.
    differentiate : ndarray of bool, (channels,)
        Channels whose input is to be differentiated in time.
    """
    if substeps == 1 and not delay_steps.any():
        return np.where(differentiate[:, None], FIVE_POINTS / step_s, np.eye(5)[2])
    reach = LIMITS.half_length * substeps
    length = 2 * reach + 2 + int(np.ceil(delay_steps.max(initial=0.0)))
    taps = np.zeros((len(delay_steps), length + len(DIFFERENCE) - 1))
    for row, delay, slope in zip(taps, delay_steps, differentiate, strict=True):
        # By latency, newest first; the difference adds 1.5 steps, for which the others wait half a step more than it.
        if slope:
            row[:] = np.convolve(_sinc(length, reach + delay + 0.5, substeps), DIFFERENCE / step_s)
        else:
            row[:] = _sinc(len(row), reach + delay + 2.0, substeps)
    return np.ascontiguousarray(taps[:, ::-1])


def _sinc(length: int, centre: float, substeps: int) -> Array:
    """Windowed sinc around a latency, of unit sum."""
    x = (np.arange(length) - centre) / substeps
    window = np.i0(7.86 * np.sqrt(np.maximum(0.0, 1 - (x / LIMITS.half_length) ** 2))) / np.i0(7.86)
    taps = np.sinc(x) * window * (np.abs(x) <= LIMITS.half_length)
    return np.asarray(taps / taps.sum())


@COMPILED
def decimate(internal: Array, taps: Array, substeps: int, out: Array) -> None:
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
    length, count = taps.shape[1], out.shape[1]
    for c in range(taps.shape[0]):
        if substeps == 1:
            # Tap by tap over neighbouring samples, which fill whole vector registers; most channels have but one.
            for n in range(count):
                out[c, n] = 0.0
            for k in range(length):
                tap = taps[c, k]
                if tap != 0.0:
                    for n in range(count):
                        out[c, n] += tap * internal[c, n + k]
            continue
        for n in range(count):
            start = (n + 1) * substeps - 1
            total = 0.0
            for k in range(length):
                total += taps[c, k] * internal[c, start + k]
            out[c, n] = total
