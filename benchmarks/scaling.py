"""What work costs as it grows, beside the strongest peer at hand: same run, one thread, processor time, equal tries."""

from collections.abc import Callable
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np


@dataclass(frozen=True)
class Cost:
    """One size: both sides' seconds, and the relative difference of their answers to the problem that was timed."""

    size: int
    ours_s: float
    other_s: float
    error: float


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """Cost against size.

    Attributes
    ----------
    sized
        What the size counts.
    per
        What the seconds are for.
    against
        The peer.
    limit
        What is promised, in words.
    held
        Whether the costs hold it.
    """

    sized: str
    per: str
    against: str
    limit: str
    held: Callable[[list[Cost]], bool]
    costs: list[Cost]

    def table(self) -> dict[str, Any]:
        """All figures, with the exponents of both sides."""
        return {
            "sized": self.sized, "per": self.per, "against": self.against, "limit": self.limit,
            "held": self.held(self.costs),
            "exponent": exponent(self.costs, lambda cost: cost.ours_s),
            "exponent_of_the_other": exponent(self.costs, lambda cost: cost.other_s),
            "costs": [asdict(cost) | {"ratio": cost.other_s / cost.ours_s} for cost in self.costs],
        }  # fmt: skip


def exponent(costs: list[Cost], seconds: Callable[[Cost], float]) -> float:
    """Of the power of size that fits the costs best, all sizes alike."""
    sizes = np.log([cost.size for cost in costs])
    return float(np.polyfit(sizes, np.log([seconds(cost) for cost in costs]), 1)[0])
