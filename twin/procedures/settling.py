"""Has the response settled?  Judged from the data: what is left of the transient, extrapolated from how it decays."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

__all__ = ["USUAL_DAMPING_RATIO", "SettlingDetector"]

USUAL_DAMPING_RATIO = 0.0023
"""Of a bolted steel structure: what is assumed before the data tell."""
USUAL_DECAY = math.exp(-2 * math.pi * USUAL_DAMPING_RATIO * 10)
"""The decay it means from one window of ten cycles to the next."""
SLOWEST_DECAY = 0.98
"""Slower than this is not told from standing still within a few windows."""


class SettlingDetector:
    """Watches the phasors of equally long windows.

    Near its end a transient is one mode's: p_k = p + c mu^k with complex mu, decay and beating.  mu is estimated from
    the successive differences while they stand out of the noise, and kept; then c, what is left in the newest window
    (k = 0), is a linear fit over all windows kept, good down to the noise, and with a known uncertainty.

    Parameters
    ----------
    tolerance
        What may remain of the transient, relative to the response of each channel.
    windows
        How many windows are looked at.
    """

    def __init__(self, tolerance: float, *, windows: int = 8) -> None:
        self._tolerance, self._count = tolerance, windows
        self._windows: deque[dict[str, complex]] = deque(maxlen=windows)
        self._stds: deque[dict[str, float]] = deque(maxlen=windows)
        self._decay: complex = USUAL_DECAY

    def add(self, phasors: Mapping[str, complex], stds: Mapping[str, float]) -> None:
        """Take the phasors of one window and their standard deviations, in a frame where a settled response rests."""
        if self._windows and phasors.keys() != self._windows[-1].keys():  # a channel came or went: begin again
            self._windows.clear()
            self._stds.clear()
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
        """Remaining transient and its standard deviation, both relative, of each channel that measures something."""
        if len(self._windows) < self._count:
            return []
        _, weights = self._weights()
        spread = float(np.linalg.norm(weights))
        judged = []
        for channel in self._windows[-1]:
            values = np.array([window[channel] for window in self._windows])
            size = abs(values.mean())
            # the smallest: a fast transient looks like noise to the fit of a window
            std = min(stds[channel] for stds in self._stds)
            if size > 5 * std:  # a channel of nothing but noise must not stop the test
                judged.append((float(abs(weights @ values)) / size, math.sqrt(2.0) * std * spread / size))
        return judged

    @property
    def steady(self) -> dict[str, complex]:
        """The phasors p that the response tends to; empty for too few windows."""
        if len(self._windows) < self._count:
            return {}
        shape, weights = self._weights()
        # p = mean(p_k) - c mean(mu^k)
        rows = 1.0 / self._count - shape.mean() * weights
        return {name: complex(rows @ [window[name] for window in self._windows]) for name in self._windows[-1]}

    def _weights(self) -> tuple[NDArray[np.complex128], NDArray[np.complex128]]:
        """Powers mu^k, and the row that gives c of p_k = p + c mu^k by least squares."""
        shape = self._decay ** np.arange(1 - self._count, 1)
        apart = (shape - shape.mean()).conj()
        return shape, apart / np.vdot(apart, apart).real

    def _estimate_decay(self) -> None:
        """Estimate mu by least squares over the successive differences of all channels, each relative to its size."""
        if len(self._windows) < 5:
            return
        above = below = 0j
        energy = noise = 0.0
        for channel in self._windows[-1]:
            values = np.array([window[channel] for window in self._windows])
            size = abs(values.mean())
            std = min(stds[channel] for stds in self._stds)
            if size <= 5 * std:
                continue
            steps = np.diff(values) / size
            # neighbouring differences share one window, whose noise would pull mu towards -1/2
            shared = (len(steps) - 1) * 2 * (std / size) ** 2
            above += complex(np.vdot(steps[:-1], steps[1:])) + shared
            below += complex(np.vdot(steps[:-1], steps[:-1])) - 2 * shared
            energy += float(np.vdot(steps, steps).real)
            noise += len(steps) * 4 * (std / size) ** 2
        if energy <= 100 * noise or below == 0:
            return
        decay = above / below
        if abs(decay) > SLOWEST_DECAY:  # grows, or hardly decays
            decay *= SLOWEST_DECAY / abs(decay)
        if abs(decay) > 0.5:  # faster is a step of the control, not a mode
            self._decay = decay
