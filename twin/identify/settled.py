"""Whether measured steps were still changing: more than the noise of response and force accounts for."""

import math
from collections.abc import Sequence

from twin.identify.sine_fit import SteadyState

LEAST_CHANGE = 2e-3
"""Relative change of a fundamental within its measurement below which a step is a steady state whatever its noise."""
FALSE_ALARMS = 0.01
"""Chance that among all steps of sound recordings one is taken for unsettled by its noise."""
NOISE_LINES = 10
"""Spectral lines behind each estimate of the noise, at the fewest: a window of five periods leaves so many."""


def still_changing(states: Sequence[SteadyState], channels: Sequence[str], *, force: str) -> list[bool]:
    """Whether a response changes against the force within each step's measurement, by more than noise does.

    Parameters
    ----------
    states
        All steps of the recordings: the more there are, the less one that stands out by chance means.
    channels, force
        The responses that are looked at, each of which is enough; the force.
    """
    most = _largest_by_chance(len(states) * len(channels))
    return [
        any(
            abs(state.change(channel, force=force)) > LEAST_CHANGE and state.change_sigma(channel, force=force) > most
            for channel in channels
        )
        for state in states
    ]


def _largest_by_chance(count: int) -> float:
    """Standard deviations that the largest of `count` changes passes in one of 1 / FALSE_ALARMS recordings.

    Two normal components over an estimate of their variance from n lines: the sum s of their squares has
    P(s > t) = (1 + t / (2 n)) ** -n.
    """
    chance = FALSE_ALARMS / max(count, 1)
    return math.sqrt(2 * NOISE_LINES * (chance ** (-1 / NOISE_LINES) - 1))
