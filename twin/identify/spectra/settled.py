"""Whether measured steps were still changing: more than the noise of response and force accounts for."""

import math
from collections.abc import Sequence

from twin.identify.limits import LIMITS
from twin.identify.spectra.sine_fit import SteadyState


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
            abs(state.change(channel, force=force)) > LIMITS.least_change
            and state.change_sigma(channel, force=force) > most
            for channel in channels
        )
        for state in states
    ]


def _largest_by_chance(count: int) -> float:
    """Standard deviations that the largest of `count` changes passes in one of 1 / LIMITS.false_alarms recordings.

    Two normal components over an estimate of their variance from n lines: the sum s of their squares has
    P(s > t) = (1 + t / (2 n)) ** -n.
    """
    chance = LIMITS.false_alarms / max(count, 1)
    return math.sqrt(2 * LIMITS.noise_lines * (chance ** (-1 / LIMITS.noise_lines) - 1))
