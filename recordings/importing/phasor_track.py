"""A sine's phasor over time, and the stretches over which its logarithm is a straight line.

A window of a few periods slides over the signal.  As long as frequency and size stay, the logarithm of its phasor is a
straight line of time; where the line has a kink or a jump, a step ends.  The lines are those that describe all windows
best, one more only where it is worth it.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Complex = NDArray[np.complex128]

PERIODS, HOP = 6, 2
"""Of a window, and from one to the next."""
LEAST_NOISE, MOST_NOISE = 5e-4, 2e-2
"""Standard deviation of a phasor relative to its size: less is not believed, more is hardly a sine."""
QUIET = 0.1
"""Share of all windows that the noise is read off: most of the others may hold the end of a step."""
WORTH = 40.0
"""Sum of squares, in variances of the noise, that a further line must save; by chance it saves about four."""
LEAST = 2
"""Windows of a line."""
CHUNK = 300
"""Windows that are divided at once; the last line of a chunk begins the next one."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """A stretch over which a sine keeps its frequency and size, from the middle of one window to that of another."""

    begin_s: float
    end_s: float
    frequency_Hz: float
    log_size: float


def track(signal: Array, rate_Hz: float, middle_s: Array, frequency_Hz: Array) -> tuple[Array, Complex]:
    """Middles of windows, s, and the logarithm of the sine's phasor in each, with a phase that is not wrapped.

    Parameters
    ----------
    signal : shape (n,)
    middle_s, frequency_Hz : shape (m,)
        Where the sine's frequency is known roughly.
    """
    centres, values, used = [], [], []
    at = PERIODS / 2 / frequency_Hz[0]
    while True:
        frequency = float(np.interp(at, middle_s, frequency_Hz))
        half, middle = int(PERIODS / 2 / frequency * rate_Hz), round(at * rate_Hz)
        if middle + half >= len(signal):
            break
        if middle >= half:
            window = np.hanning(2 * half + 3)[1:-1]
            part = signal[middle - half : middle + half + 1]
            turning = np.exp(-2j * np.pi * frequency / rate_Hz * np.arange(-half, half + 1))
            mean = np.average(part, weights=window)
            values.append(2 * np.sum((part - mean) * window * turning) / window.sum())
            centres.append(middle / rate_Hz)
            used.append(frequency)
        at += HOP / frequency
    phasor, centre_s, near = np.array(values, dtype=np.complex128), np.array(centres), np.array(used)
    if not len(phasor):
        return centre_s, phasor
    expected = np.pi * (near[1:] + near[:-1]) * np.diff(centre_s)
    turned = expected + np.angle(np.exp(1j * (np.diff(np.angle(phasor)) - expected)))
    phase = np.concatenate([[0.0], np.cumsum(turned)]) + np.angle(phasor[0])
    return centre_s, np.log(np.maximum(np.abs(phasor), 1e-300)) + 1j * phase


def straight_parts(time_s: Array, values: Complex) -> list[Part]:
    """Straight lines that describe the logarithm of a phasor, in order of time."""
    variance = _noise(time_s, values) ** 2
    parts, start, chunk = [], 0, CHUNK
    while len(values) - start >= LEAST:
        stop = min(start + chunk, len(values))
        edges = _divided(time_s[start:stop], values[start:stop], variance)
        if len(edges) == 2 and stop < len(values):
            chunk *= 2  # one step lasts longer than the chunk
            continue
        whole = edges if stop == len(values) else edges[:-1]
        for first, last in itertools.pairwise(whole):
            parts.append(_part(time_s[start + first : start + last], values[start + first : start + last]))
        if stop == len(values):
            break
        start, chunk = start + whole[-1], CHUNK
    return parts


def _noise(time_s: Array, values: Complex) -> float:
    """Standard deviation of a phasor, from how three windows that do not overlap lie off a line."""
    lag = PERIODS // HOP
    if len(values) <= 2 * lag:
        return LEAST_NOISE
    between = (time_s[lag:-lag] - time_s[: -2 * lag]) / (time_s[2 * lag :] - time_s[: -2 * lag])
    bend = np.abs(values[lag:-lag] - values[: -2 * lag] * (1 - between) - values[2 * lag :] * between)
    # The square of a complex bend is distributed exponentially about 1.5 variances.
    noise = float(np.quantile(bend, QUIET)) / np.sqrt(-1.5 * np.log(1 - QUIET))
    return min(max(noise, LEAST_NOISE), MOST_NOISE)


def _divided(time_s: Array, values: Complex, variance: float) -> list[int]:
    """Where lines begin, and the end: the division with the least sum of squares and lines' worth."""
    mean_s = time_s.mean()
    time = time_s - mean_s
    slope = np.sum(time * values) / np.sum(time**2)
    values = values - values.mean() - slope * time  # what is left is small, and sums of its squares are exact
    ones = np.ones(len(time))
    sums = [
        np.concatenate([[0], np.cumsum(each)])
        for each in (ones, time, time**2, values, time * values, np.abs(values) ** 2)
    ]
    best, origin = np.full(len(time) + 1, np.inf), np.zeros(len(time) + 1, dtype=int)
    best[0] = 0.0
    for stop in range(LEAST, len(time) + 1):
        starts = np.arange(stop - LEAST + 1)
        n, t, tt, v, tv, vv = (each[stop] - each[starts] for each in sums)
        spread = np.maximum(tt - t**2 / n, 1e-300)
        rest = np.maximum(vv - np.abs(v) ** 2 / n - np.abs(tv - t * v / n) ** 2 / spread, 0.0)
        cost = best[starts] + rest / variance + WORTH
        origin[stop] = int(np.argmin(cost))
        best[stop] = cost[origin[stop]]
    edges = [len(time)]
    while edges[-1]:
        edges.append(int(origin[edges[-1]]))
    return edges[::-1]


def _part(time_s: Array, values: Complex) -> Part:
    centred = time_s - time_s.mean()
    mean = values.mean()
    slope = np.sum(centred * (values - mean)) / np.sum(centred**2)
    return Part(
        begin_s=float(time_s[0]), end_s=float(time_s[-1]), frequency_Hz=float(slope.imag / (2 * np.pi)),
        log_size=float(mean.real),
    )  # fmt: skip
