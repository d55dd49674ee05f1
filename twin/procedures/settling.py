"""Has the response settled?  Judged from the data: what is left of the transient, extrapolated from how it decays."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np

__all__ = ["SettlingDetector"]

USUAL_DECAY = math.exp(-1.0 / 7.0)
"""Decay from window to window before the data tell: Q = 220 and windows of ten cycles."""


class SettlingDetector:
    """Watches the phasors of equally long windows.

    Near its end a transient is one mode's: p_k = p + c mu^k with complex mu (decay and beating).  The change between
    the means of the last and the previous `half` windows is then proportional to what remains, c mu^k; the factor
    follows from mu, which is estimated from the successive differences while they stand out of the noise.  Means of
    several windows see a transient of the noise's own size, single differences would not.

    Parameters
    ----------
    tolerance
        What may remain of the transient, relative to the response of each channel.
    half
        Windows in each of the two means.
    """

    def __init__(self, tolerance: float, *, half: int = 4) -> None:
        self._tolerance, self._half = tolerance, half
        self._windows: deque[dict[str, complex]] = deque(maxlen=2 * half)
        self._stds: deque[dict[str, float]] = deque(maxlen=2 * half)
        self._decay: complex = USUAL_DECAY

    def add(self, phasors: Mapping[str, complex], stds: Mapping[str, float]) -> None:
        """Take the phasors of one window and their standard deviations, in a frame where a settled response rests."""
        self._windows.append(dict(phasors))
        self._stds.append(dict(stds))
        self._estimate_decay()

    @property
    def remaining(self) -> float:
        """The worst channel's remaining transient, relative to its response; infinite for too few windows."""
        return max((left for left, _ in self._judge()), default=math.inf)

    @property
    def settled(self) -> bool:
        """Whether every channel's remaining transient is within the tolerance, or within the noise above it."""
        judged = self._judge()
        return bool(judged) and all(left <= max(self._tolerance, 3 * noise) for left, noise in judged)

    def _judge(self) -> list[tuple[float, float]]:
        """Remaining transient and its noise of each channel."""
        half = self._half
        if len(self._windows) < 2 * half:
            return []
        powers = self._decay ** -np.arange(half)
        change = abs(powers.sum() * (1 - self._decay**-half)) / half
        gain = max(1.0, 1.0 / max(change, 1e-6))
        judged = []
        for channel in self._windows[-1]:
            values = np.array([window[channel] for window in self._windows])
            size = abs(values[half:].mean())
            noise = float(np.mean([stds[channel] for stds in self._stds])) * math.sqrt(2.0 / half)
            if size <= 5 * noise:  # nothing but noise: a channel that measures nothing must not stop the test
                continue
            left = gain * abs(values[half:].mean() - values[:half].mean())
            judged.append((left / size, gain * noise / size))
        return judged

    def _estimate_decay(self) -> None:
        """Estimate mu by least squares over the successive differences of all channels, each relative to its size."""
        if len(self._windows) < 5:
            return
        above = below = 0j
        energy, noise = 0.0, 0.0
        for channel in self._windows[-1]:
            values = np.array([window[channel] for window in self._windows])
            size = abs(values[-1])
            if size == 0.0:
                continue
            steps = np.diff(values) / size
            above += np.vdot(steps[:-1], steps[1:])
            below += np.vdot(steps[:-1], steps[:-1])
            energy += float(np.vdot(steps, steps).real)
            noise += sum((stds[channel] / size) ** 2 for stds in self._stds) * 4
        if energy > 25 * noise and abs(below) > 0:
            decay = above / below
            # a transient that does not decay (yet) counts as very slow, whatever direction it turns
            self._decay = decay if abs(decay) < 0.98 else 0.98
            if abs(self._decay) < 0.5:  # control steps, not a mode: fall back on what a mode usually does
                self._decay = USUAL_DECAY
