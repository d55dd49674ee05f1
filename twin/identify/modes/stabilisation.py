"""Which poles of a chart are modes: those that stay where they are as the order grows."""

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.identify.limits import LIMITS
from twin.identify.modes.rational import ChartPole


@dataclass(frozen=True)
class StableGroup:
    """Poles of several orders that are one mode's: their medians, and the share of the orders that have it."""

    frequency_Hz: float
    damping_ratio: float
    share: float


def stable_poles(chart: Sequence[ChartPole]) -> list[ChartPole]:
    """Poles that the next lower order has too, within the tolerances."""
    stable = []
    orders = sorted({pole.order for pole in chart})
    by_order = {order: [pole for pole in chart if pole.order == order] for order in orders}
    for below, order in itertools.pairwise(orders):
        for pole in by_order[order]:
            if pole.damping_ratio < LIMITS.largest_damping and any(_alike(pole, other) for other in by_order[below]):
                stable.append(pole)
    return stable


def stable_groups(chart: Sequence[ChartPole]) -> list[StableGroup]:
    """Groups of stable poles, rising in frequency, that enough of the orders have."""
    orders = sorted({pole.order for pole in chart})
    left = sorted(stable_poles(chart), key=lambda pole: pole.frequency_Hz)
    groups = []
    while left:
        group = [left.pop(0)]
        while left and left[0].frequency_Hz - group[-1].frequency_Hz < _reach(group):
            group.append(left.pop(0))
        seen = {pole.order for pole in group}
        possible = [order for order in orders if order >= min(seen)]
        # A mode that only the last few orders show has not had its chance to prove stable.
        share = len(seen) / max(len(possible), len(orders) // 2)
        if share >= LIMITS.stabilisation_share:
            frequency, damping = (
                float(np.median([getattr(pole, name) for pole in group])) for name in ("frequency_Hz", "damping_ratio")
            )
            groups.append(StableGroup(frequency, damping, share))
    return groups


def _alike(one: ChartPole, other: ChartPole) -> bool:
    return (
        abs(one.frequency_Hz - other.frequency_Hz) < LIMITS.frequency_tolerance * one.frequency_Hz
        and abs(one.damping_ratio - other.damping_ratio) < LIMITS.damping_tolerance * one.damping_ratio
    )


def _reach(group: Sequence[ChartPole]) -> float:
    """How far the next member may be, Hz."""
    width = LIMITS.widest_half_widths * float(np.median([pole.damping_ratio for pole in group]))
    return min(width, LIMITS.frequency_tolerance) * group[-1].frequency_Hz
