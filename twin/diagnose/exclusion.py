"""What the data rule out: the largest size of each cause that a rig with these recordings could hide."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from twin.diagnose.cause import strengths_of
from twin.diagnose.places import told_place
from twin.diagnose.score import Score
from twin.identify.measured_data import MeasuredData


@dataclass(frozen=True)
class Exclusion:
    """The limit of one cause.

    Attributes
    ----------
    cause, parameter : str
        The parameter is the one that says how strong the effect is, and the limit its distance from no effect.
    limit_95 : float or None
        None where the data cannot limit it.
    where : dict
        Label and place where it hides best.
    """

    cause: str
    parameter: str
    limit_95: float | None
    where: dict[str, Any]


def exclusion_limits(evidence: MeasuredData, scores: Sequence[Score]) -> tuple[Exclusion, ...]:
    """The limit of every scored cause at the place where it hides best; the tightest first, by the usual size."""
    largest: dict[str, tuple[float, Exclusion]] = {}
    for score in scores:
        hypothesis, name = score.hypothesis, score.hypothesis.cause.name
        parameters = hypothesis.cause.parameters(evidence, hypothesis.label)
        strengths = strengths_of(parameters)
        if not strengths:
            continue
        main = strengths[0]
        rising, falling = main.upper > main.null, main.lower < main.null
        size = abs(score.size) if rising and falling else max(score.size if rising else -score.size, 0.0)
        largest_size = max(main.upper - main.null, main.null - main.lower)
        limit = size + 1.645 * score.std  # 95 % of a normal distribution lie below 1.645 standard deviations
        share = limit / main.scale if limit < largest_size else np.inf
        if name in largest and share <= largest[name][0]:
            continue
        values = {p.name: hypothesis.values[p.name] for p in parameters if p.is_location}
        where, _, _ = told_place(evidence, hypothesis.label, values, {})
        told = limit if np.isfinite(share) else None
        largest[name] = share, Exclusion(name, main.name, told, {**hypothesis.label, **where})
    return tuple(exclusion for _, exclusion in sorted(largest.values(), key=lambda item: item[0]))
