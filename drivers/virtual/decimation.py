"""Fewer samples a second for a slow bus: low-pass and every n-th sample, without a shift in time."""

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray

KAISER_BETA = 0.1102 * (90.0 - 8.7)
"""Of the filter's window: 90 dB (J. F. Kaiser's formula)."""
HALF_LENGTH = 16
"""Of the filter, in samples of the lower rate: flat to 0.4 times that rate, 90 dB down from 0.6 times on."""


class Decimator:
    """A linear-phase filter whose delay is taken out: sample n of the output is at the time of input `n * factor`.

    Before the stream the input is taken to have been at its first value, after it at its last.

    Parameters
    ----------
    channels
        How many.
    factor
        Input samples to one of the output; with 1 nothing is changed.
    """

    def __init__(self, channels: int, factor: int) -> None:
        self.factor = factor
        self._half = HALF_LENGTH * factor if factor > 1 else 0
        length = 2 * self._half + 1
        taps = np.sinc(np.arange(-self._half, self._half + 1) / factor) * np.kaiser(length, KAISER_BETA)
        self._taps = taps / taps.sum()
        self._kept = np.empty((channels, 0))
        self._begun = False

    def take(self, values: NDArray[np.floating]) -> NDArray[np.floating]:
        """Output samples, shape (channels, m), that the next input samples, shape (channels, n), complete.

        Every output sample that a lost one (NaN) has a part in is NaN.
        """
        if self.factor == 1 or not values.shape[1]:
            return values
        if not self._begun:
            self._begun = True
            self._kept = np.repeat(values[:, :1], self._half, axis=1)
        held = np.concatenate((self._kept, values), axis=1)
        count = max(0, (held.shape[1] - len(self._taps)) // self.factor + 1)
        self._kept = held[:, count * self.factor :]
        if not count:
            return held[:, :0]
        windows = sliding_window_view(held, len(self._taps), axis=1)[:, :: self.factor][:, :count]
        return np.asarray(windows @ self._taps)

    def flush(self) -> NDArray[np.floating]:
        """The output samples that still wait for input."""
        if not self._begun:
            return self._kept
        return self.take(np.repeat(self._kept[:, -1:], self._half, axis=1))
