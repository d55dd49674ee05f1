"""Has the response settled?  Judged from the data: what is left of the transient, extrapolated from how it decays."""

import math
from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from twin.arrays import Array
from twin.procedures.limits import LIMITS


def usual_rate(frequency_Hz: float) -> complex:
    """Rate of a free decay, 1/s, before the data tell."""
    return complex(-2 * math.pi * LIMITS.usual_damping_ratio * frequency_Hz)


@dataclass(frozen=True)
class _Window:
    time_s: float
    phasors: dict[str, complex]
    stds: dict[str, float]


class SettlingDetector:
    """Watches the phasors of equally long windows.

    Near its end a transient is one mode's: p_k = p + c exp(s t_k) with complex s, decay and beating.  s is estimated
    from the successive differences while they stand out of the noise, and kept; then c, what is left in the newest
    window, is a linear fit over all windows kept, good down to the noise, and with a known uncertainty.

    Parameters
    ----------
    tolerance
        What may remain of the transient, relative to the response of each channel.
    rate
        s, 1/s, as far as it is known.
    certain
        Whether it is known from data, so that few windows are enough to tell what remains.
    """

    def __init__(self, tolerance: float, *, rate: complex, certain: bool = False) -> None:
        self._tolerance = tolerance
        self._windows: deque[_Window] = deque(maxlen=LIMITS.settling_full)
        self.rate, self.certain = rate, certain

    def add(self, phasors: Mapping[str, complex], stds: Mapping[str, float], *, time_s: float) -> None:
        """Take the phasors of one window and their standard deviations, in a frame where a settled response rests."""
        if self._windows and phasors.keys() != self._windows[-1].phasors.keys():  # a channel came or went
            self.restart()
        self._windows.append(_Window(time_s, dict(phasors), dict(stds)))
        self._estimate_rate()

    def restart(self) -> None:
        """Forget the windows, keep the rate: something was done to the response."""
        self._windows.clear()

    @property
    def remaining(self) -> float:
        """The worst channel's remaining transient, relative to its response; infinite for too few windows."""
        return max((left for left, _ in self._judge()), default=math.inf)

    @property
    def settled(self) -> bool:
        """Whether every channel's remaining transient is within the tolerance, or within the noise above it."""
        judged = self._judge()
        return bool(judged) and all(left <= max(self._tolerance, 3 * noise) for left, noise in judged)

    @property
    def steady(self) -> dict[str, complex]:
        """The phasors p that the response tends to; empty for too few windows."""
        return {name: p for name, (p, _) in self.split().items()}

    def split(self) -> dict[str, tuple[complex, complex]]:
        """Per channel p and c, the transient in the newest window; empty for too few windows."""
        if not self._enough():
            return {}
        shape, weights = self._weights()
        found = {}
        for name in self._windows[-1].phasors:
            values = self._values(name)
            c = complex(weights @ values)
            found[name] = (complex(values.mean() - c * shape.mean()), c)
        return found

    def _judge(self) -> list[tuple[float, float]]:
        """Remaining transient and its standard deviation, both relative, of each channel that measures something."""
        spread = float(np.linalg.norm(self._weights()[1])) if len(self._windows) > 1 else 0.0
        judged = []
        for name, (_, c) in self.split().items():
            size, std = self._size(name)
            if size > 5 * std:  # a channel of nothing but noise must not stop the test
                judged.append((abs(c) / size, math.sqrt(2.0) * std * spread / size))
        return judged

    def _enough(self) -> bool:
        if len(self._windows) < LIMITS.settling_full:
            if not self.certain or len(self._windows) < LIMITS.settling_fewest:
                return False
            return float(np.linalg.norm(self._weights()[1])) < LIMITS.well_known
        return True

    def _values(self, name: str) -> Array:
        return np.array([window.phasors[name] for window in self._windows])

    def _size(self, name: str) -> tuple[float, float]:
        """Magnitude of a channel and its noise, the smallest: a fast transient looks like noise to a window's fit."""
        return float(abs(self._values(name).mean())), min(window.stds[name] for window in self._windows)

    def _weights(self) -> tuple[Array, Array]:
        """exp(s (t_k - t_last)), and the row that gives c of p_k = p + c exp(..) by least squares."""
        times = np.array([window.time_s for window in self._windows])
        shape = np.exp(self.rate * (times - times[-1]))
        apart = (shape - shape.mean()).conj()
        return shape, apart / max(np.vdot(apart, apart).real, 1e-12)

    def _estimate_rate(self) -> None:
        """Estimate s by least squares over the successive differences of all channels, each relative to its size."""
        times = np.array([window.time_s for window in self._windows])
        gaps = np.diff(times)
        if len(times) < 5 or np.ptp(gaps) > 0.02 * gaps[0]:
            return
        above = below = 0j
        energy = noise = 0.0
        for name in self._windows[-1].phasors:
            size, std = self._size(name)
            if size <= 5 * std:
                continue
            steps = np.diff(self._values(name)) / size
            # neighbouring differences share one window, whose noise would pull the decay towards -1/2
            shared = (len(steps) - 1) * 2 * (std / size) ** 2
            above += complex(np.vdot(steps[:-1], steps[1:])) + shared
            below += complex(np.vdot(steps[:-1], steps[:-1])) - 2 * shared
            energy += float(np.vdot(steps, steps).real)
            noise += len(steps) * 4 * (std / size) ** 2
        if energy <= 100 * noise or below == 0:
            return
        decay = above / below
        if abs(decay) < 0.5:  # a step of the control, not a mode
            return
        # what grows, or hardly decays, is not told from standing still within a few windows
        self.rate = complex(min(math.log(abs(decay)), math.log(0.98)), np.angle(decay)) / float(gaps[0])
        self.certain = True
