"""What the data rule out: the largest size of each cause that a rig with these recordings could hide.

A larger one would have been named in 95 of 100 recordings.  That is a limit of detection, not only of confidence
(Currie 1968): a cause is named only where it is more probable than none.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from twin.diagnose.answer.parameter_text import size_text
from twin.diagnose.cause import Parameter, strengths_of
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.limits import LIMITS
from twin.diagnose.places import told_place
from twin.diagnose.posterior import log_odds, temperature
from twin.diagnose.selection.score_test import Score
from twin.identify.measured_data import MeasuredData


@dataclass(frozen=True)
class Exclusion:
    """The limit of one cause."""

    cause: str
    parameter: str
    """The parameter is the one that says how strong the effect is, and the limit its distance from no effect."""
    limit_95: float | None
    """None where the data cannot limit it."""
    where: dict[str, Any]
    """Label and place where it hides best."""

    @property
    def in_words(self) -> str:
        """The limit in engineering units."""
        return size_text(self.parameter, self.limit_95)


def exclusion_limits(evidence: MeasuredData, scores: Sequence[Score]) -> tuple[Exclusion, ...]:
    """The limit of every scored cause at the place where it hides best; the tightest first, by the usual size."""
    found = sorted(_largest(evidence, scores).values(), key=lambda hidden: hidden.share)
    return tuple(hidden.told(evidence) for hidden in found)


def hidden_at_limit(evidence: MeasuredData, scores: Sequence[Score], cause: str) -> CauseHypothesis | None:
    """A cause where it hides best, of the largest size it may have there; of its usual one if the data limit it not."""
    hidden = _largest(evidence, scores).get(cause)
    return None if hidden is None else hidden.hypothesis


@dataclass(frozen=True)
class _Hidden:
    """What a cause could be without being seen.

    Attributes
    ----------
    limit : float
        Of its first strength, away from no effect; infinite where any size the parameter may have could hide.
    share : float
        The limit over the usual size.
    """

    score: Score
    main: Parameter
    limit: float

    @property
    def share(self) -> float:
        return self.limit / self.main.scale

    @property
    def hypothesis(self) -> CauseHypothesis:
        main, own = self.main, self.score.hypothesis
        away = self.limit if np.isfinite(self.limit) else main.scale
        return replace(own, values={**own.values, main.name: main.null + (away if main.upper > main.null else -away)})

    def told(self, evidence: MeasuredData) -> Exclusion:
        own = self.score.hypothesis
        locations = {p.name for p in own.cause.parameters(evidence, own.label) if p.is_location}
        values = {name: value for name, value in own.values.items() if name in locations}
        where, _, _ = told_place(evidence, own.label, values, {})
        limit = self.limit if np.isfinite(self.limit) else None
        return Exclusion(own.cause.name, self.main.name, limit, {**own.label, **where})


def _largest(evidence: MeasuredData, scores: Sequence[Score]) -> dict[str, _Hidden]:
    """Each cause where it hides best."""
    largest: dict[str, _Hidden] = {}
    for score in scores:
        hypothesis, name = score.hypothesis, score.hypothesis.cause.name
        strengths = strengths_of(hypothesis.cause.parameters(evidence, hypothesis.label))
        if not strengths:
            continue
        main = strengths[0]
        rising, falling = main.upper > main.null, main.lower < main.null
        size = abs(score.size) if rising and falling else max(score.size if rising else -score.size, 0.0)
        limit = max(size, _least_named(evidence, score)) + LIMITS.exclusion_limit_95 * score.std
        hidden = _Hidden(score, main, limit if limit < max(main.upper - main.null, main.null - main.lower) else np.inf)
        if name not in largest or hidden.share > largest[name].share:
            largest[name] = hidden
    return largest


def _least_named(evidence: MeasuredData, score: Score) -> float:
    """The estimate from which on the cause is more probable than none, away from no effect.

    To first order the log evidence goes by the square of the estimate over its standard deviation.
    """
    needed = -temperature(evidence) * log_odds(evidence, score.hypothesis.cause)
    return math.hypot(score.size, score.std * math.sqrt(2 * max(needed - score.log_bayes, 0.0)))
