"""A column of times as a sample rate, a start, and the numbers of the samples that were taken."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from recordings.importing.labels import TIME_UNITS

JITTER = 0.3
"""Sampling intervals by which a time may lie off the even grid."""
DIGITS = 6
"""Of a rate that people set: it is taken as rounded to so many where the times allow that."""
MOST_LOST = 1 << 24


@dataclass(frozen=True)
class TimeAxis:
    """When the samples of a table were taken; `number` (n,) counts sampling intervals from the first on."""

    sample_rate_Hz: float
    start_ns: int
    number: NDArray[np.int64]


def axis_of(times: NDArray[np.float64] | NDArray[np.datetime64], unit: str) -> TimeAxis:
    """The even grid on which times lie.

    Parameters
    ----------
    times : shape (n,)
        In `unit`, or as moments.
    unit
        Of :data:`recordings.importing.labels.TIME_UNITS`; seconds if empty.

    Raises
    ------
    ValueError
        With the reason, if they do not rise, or lie on no even grid.
    """
    start_ns, time_s = 0, np.empty(0)
    if times.dtype.kind == "M":
        stamps = times.astype("datetime64[ns]").astype(np.int64)
        start_ns, time_s = int(stamps[0]), (stamps - stamps[0]) * 1e-9
    else:
        time_s = times.astype(np.float64) * TIME_UNITS[unit.strip().lower() or "s"]
        if np.all(np.isfinite(time_s)):
            start_ns = round(float(time_s[0]) * 1e9) if 0 <= time_s[0] < 4e9 else 0
            time_s = time_s - time_s[0]
    if not np.all(np.isfinite(time_s)):
        raise ValueError(f"row {1 + int(np.argmin(np.isfinite(time_s)))} has no time")
    steps = np.diff(time_s)
    if not len(steps) or np.any(steps <= 0):
        raise ValueError(f"does not rise at row {2 + int(np.argmax(steps <= 0))}" if len(steps) else "is a single row")
    step = float(np.median(steps))
    number = np.concatenate([[0], np.cumsum(np.maximum(np.rint(steps / step), 1))]).astype(np.int64)
    step = float(time_s[-1] / number[-1])
    off = np.abs(time_s / step - number)
    if off.max() > JITTER:
        raise ValueError(f"is not evenly sampled: row {1 + int(np.argmax(off > JITTER))} lies between samples")
    if number[-1] > len(number) + MOST_LOST:
        raise ValueError(f"leaps over {number[-1] - len(number)} samples")
    rate = 1 / step
    rounded = float(f"{rate:.{DIGITS}g}")
    if abs(rounded / rate - 1) * number[-1] < max(2 * off.max(), 1e-6):
        rate = rounded
    return TimeAxis(rate, start_ns, number)
