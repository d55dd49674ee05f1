"""A multisine: equally high sines at the multiples of one frequency, with phases drawn by chance.

It repeats exactly, so that a periodic response has no leakage at all, and what is left between its lines is noise and
distortion alone.  Schoukens, Vaes and Pintelon, "Linear System Identification in a Nonlinear Setting", IEEE Control
Systems Magazine 36 (2016) 38-69, on why its phases are random.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.signal import CZT


class PeriodicSignal:
    """Values of unit rms at equal steps, whatever part of the period a step is.

    Parameters
    ----------
    period_s
        After which it repeats.
    band_Hz
        Its lines are the multiples of 1/`period_s` in it.
    seed
        Of the phases.
    step_s
        From one value to the next.

    Raises
    ------
    ValueError
        If there is no line in the band, below half of the rate 1/`step_s`.
    """

    def __init__(self, *, period_s: float, band_Hz: tuple[float, float], seed: int, step_s: float) -> None:
        high = min(band_Hz[1], 0.5 / step_s)
        first, last = int(np.ceil(band_Hz[0] * period_s - 1e-9)), int(np.floor(high * period_s + 1e-9))
        self._order = np.arange(max(first, 1), last + 1)
        if len(self._order) == 0:
            raise ValueError(f"a period of {period_s:g} s has no line from {band_Hz[0]:g} to {high:g} Hz")
        phase = np.random.default_rng(seed).uniform(0, 2 * np.pi, len(self._order))
        self._lines = np.sqrt(2 / len(self._order)) * np.exp(1j * phase)
        self._turn = step_s / period_s
        self._at = 0.0
        self._transform: CZT | None = None

    def samples(self, count: int) -> NDArray[np.float64]:
        """The next `count` values."""
        if count == 0:
            return np.zeros(0)
        if self._transform is None or self._transform.m != count:
            # Re sum_k c_k exp(2 pi i k (t + n step)/T) over n is a chirp transform of the lines' phasors at time t
            self._transform = CZT(n=len(self._order), m=count, w=np.exp(2j * np.pi * self._turn))
        now = self._lines * np.exp(2j * np.pi * self._order * self._at)
        values = self._transform(now) * np.exp(2j * np.pi * self._order[0] * self._turn * np.arange(count))
        self._at = (self._at + count * self._turn) % 1.0
        return np.asarray(values.real)
