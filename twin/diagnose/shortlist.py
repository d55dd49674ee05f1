"""Which causes are fitted at all, and from where: the best of the score test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.candidate import Blame
from twin.diagnose.cause import main_strength
from twin.diagnose.score import Score
from twin.diagnose.tournament import LEAST_SCORE
from twin.identify.evidence import Evidence

__all__ = ["shortlist"]

SHORTLIST = 12
FAR_m = 0.08
"""Between two places of one cause that are worth a trial each."""
PLACES = 2
"""Beginnings of a cause from which it is tried."""
TUNED = 4
"""The same of a cause with a frequency of its own: between the structure's resonances lie false minima."""
FAR_TUNED = 0.5
"""Logarithm of the ratio of frequencies of the further ones, wherever they sit."""


def shortlist(evidence: Evidence, scores: list[Score]) -> list[Blame]:
    """The best causes with their labels, each at its best place and at the best ones well apart from that.

    Where anything promises a gain, causes that must be tried at their full size are, too.
    """
    places: dict[str, list[Score]] = {}
    for score in scores:
        chosen = places.setdefault(score.blame.key, [])
        if _begins_elsewhere(score.blame, [other.blame for other in chosen]):
            chosen.append(score)
    leading = [chosen for chosen in places.values() if chosen[0].gain > LEAST_SCORE][:SHORTLIST]
    if not leading:
        return []
    scored = [score.blame for chosen in leading for score in chosen if not score.blame.cause.tried_at_full_size]
    large = [s.blame for chosen in places.values() for s in chosen if s.blame.cause.tried_at_full_size]
    return scored + [_at_full_size(evidence, blame) for blame in large]


def _at_full_size(evidence: Evidence, blame: Blame) -> Blame:
    """The same with the strength that such an effect usually has."""
    main = main_strength(blame.cause.parameters(evidence, blame.label))
    if main is None:
        return blame
    full = main.null + np.copysign(main.scale, blame.values[main.name] - main.null)
    return replace(blame, values={**blame.values, main.name: float(np.clip(full, main.lower, main.upper))})


def _begins_elsewhere(blame: Blame, chosen: list[Blame]) -> bool:
    """Whether a beginning is worth a trial beside those chosen already."""
    if len(chosen) < PLACES:
        return all(_apart(blame, other) for other in chosen)
    return len(chosen) < TUNED and all(_ratio(blame, other, "frequency_Hz") > FAR_TUNED for other in chosen)


def _apart(one: Blame, two: Blame) -> bool:
    """Whether two places of one cause lie a fifth of the structure or a quarter of the frequency apart."""
    along = [name for name in one.values if name.startswith("position_") and name in two.values]
    moved = any(abs(one.values[name] - two.values[name]) > FAR_m for name in along)
    return moved or any(_ratio(one, two, name) > 0.25 for name in ("frequency_Hz", "gap_m", "slip_m"))


def _ratio(one: Blame, two: Blame, name: str) -> float:
    """Logarithm of the ratio of two values; 0 without them."""
    return abs(float(np.log(one.values[name] / two.values[name]))) if name in one.values else 0.0
