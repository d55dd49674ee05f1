"""The pulse of a hammer: a half sine, twice where it rebounds."""

import math

import numpy as np
from numpy.typing import NDArray

from twin.bench.limits import LIMITS


def pulse(peak_N: float, width_s: float, step_s: float, *, rebound: bool = False) -> NDArray[np.float64]:
    """Force at every step of a half sine; one that rebounds hits again, weaker, while the structure still rings."""
    steps = np.arange(math.ceil(width_s / step_s) + 1)
    once = peak_N * np.sin(np.minimum(np.pi * steps * step_s / width_s, np.pi))
    if not rebound:
        return np.asarray(once)
    later = round(LIMITS.rebound_s / step_s)
    both = np.zeros(later + len(once))
    both[: len(once)] += once
    both[later:] += LIMITS.rebound_share * once
    return both
