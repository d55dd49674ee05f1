"""Which causes are fitted at all, and from where: the best of the score test."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from twin.diagnose.cause import main_strength
from twin.diagnose.fitted_model import CauseHypothesis
from twin.diagnose.score import Score
from twin.diagnose.successive_halving import LEAST_SCORE
from twin.identify.measured_data import MeasuredData

__all__ = ["screening"]

SHORTLIST = 12
FAR_m = 0.08
"""Between two places of one cause that are worth a trial each."""
PLACES = 2
"""Beginnings of a cause from which it is tried."""
TUNED = 4
"""The same of a cause with a frequency of its own: between the structure's resonances lie false minima."""
FAR_TUNED = 0.5
"""Logarithm of the ratio of frequencies of the further ones, wherever they sit."""


def screening(evidence: MeasuredData, scores: list[Score]) -> list[CauseHypothesis]:
    """The best causes with their labels, each at its best place and at the best ones well apart from that.

    Where anything promises a gain, causes that must be tried at their full size are, too.
    """
    places: dict[str, list[Score]] = {}
    for score in scores:
        chosen = places.setdefault(score.hypothesis.key, [])
        if _begins_elsewhere(score.hypothesis, [other.hypothesis for other in chosen]):
            chosen.append(score)
    leading = [chosen for chosen in places.values() if chosen[0].gain > LEAST_SCORE][:SHORTLIST]
    if not leading:
        return []
    scored = [
        score.hypothesis for chosen in leading for score in chosen if not score.hypothesis.cause.tried_at_full_size
    ]
    large = [s.hypothesis for chosen in places.values() for s in chosen if s.hypothesis.cause.tried_at_full_size]
    return scored + [_at_full_size(evidence, hypothesis) for hypothesis in large]


def _at_full_size(evidence: MeasuredData, hypothesis: CauseHypothesis) -> CauseHypothesis:
    """The same with the strength that such an effect usually has."""
    main = main_strength(hypothesis.cause.parameters(evidence, hypothesis.label))
    if main is None:
        return hypothesis
    full = main.null + np.copysign(main.scale, hypothesis.values[main.name] - main.null)
    return replace(hypothesis, values={**hypothesis.values, main.name: float(np.clip(full, main.lower, main.upper))})


def _begins_elsewhere(hypothesis: CauseHypothesis, chosen: list[CauseHypothesis]) -> bool:
    """Whether a beginning is worth a trial beside those chosen already."""
    if len(chosen) < PLACES:
        return all(_apart(hypothesis, other) for other in chosen)
    return len(chosen) < TUNED and all(_ratio(hypothesis, other, "frequency_Hz") > FAR_TUNED for other in chosen)


def _apart(one: CauseHypothesis, two: CauseHypothesis) -> bool:
    """Whether two places of one cause lie a fifth of the structure or a quarter of the frequency apart."""
    along = [name for name in one.values if name.startswith("position_") and name in two.values]
    moved = any(abs(one.values[name] - two.values[name]) > FAR_m for name in along)
    return moved or any(_ratio(one, two, name) > 0.25 for name in ("frequency_Hz", "gap_m", "slip_m"))


def _ratio(one: CauseHypothesis, two: CauseHypothesis, name: str) -> float:
    """Logarithm of the ratio of two values; 0 without them."""
    return abs(float(np.log(one.values[name] / two.values[name]))) if name in one.values else 0.0
