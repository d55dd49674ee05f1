"""Posterior probabilities of all hypotheses, and the fewest that hold 95 % of it: the one rule of every verdict.

A hypothesis' weight is its log evidence plus its prior odds.  ``none`` is the base family with the errors of sound
rigs, ``unknown`` the best model with errors of any size.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from twin.diagnose.cause import Cause
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies

LOG_ODDS_OF_A_CAUSE = float(np.log(0.01))
"""Of each cause beforehand, against none: of a hundred measured rigs some thirty have one of thirty-odd causes."""
RARER_IN_FREQUENCIES = {"stiffness-loss": 0.01}
"""Odds over other causes' where frequencies alone speak: a specimen is rarely damaged, and models of laminates always
leave something out.  Set with the composite beam's four frequencies in sight."""
LOG_ODDS_OF_UNKNOWN = float(np.log(0.03))
"""Of something that is on no list."""
SURE = 0.95


@dataclass(frozen=True)
class Weighed:
    """A hypothesis with what its probability is made of."""

    name: str
    """Of its causes, or ``none`` or ``unknown``."""
    causes: int
    """How many it has."""
    log_evidence: float
    """Up to a constant that all hypotheses about the same data share."""
    log_prior: float
    """Prior odds of its causes and, for ``unknown``, those of something on no list."""


def temperature(evidence: MeasuredData) -> float:
    """:data:`LIMITS.posterior_temperature` of recordings.

    Of frequencies alone one: there are few, and how far a model may be off them is in the evidence.
    """
    return 1.0 if isinstance(evidence, MeasuredFrequencies) else LIMITS.posterior_temperature


def least_gain(evidence: MeasuredData) -> float:
    """Log evidence by which a model with one more cause must be ahead."""
    return -LOG_ODDS_OF_A_CAUSE * temperature(evidence)


def log_odds(evidence: MeasuredData, cause: Cause) -> float:
    """Of a cause with one of its labels beforehand, against none: it is shared out among them."""
    rarer = RARER_IN_FREQUENCIES.get(cause.name, 1.0) if isinstance(evidence, MeasuredFrequencies) else 1.0
    return LOG_ODDS_OF_A_CAUSE + float(np.log(rarer)) - float(np.log(len(cause.labels(evidence))))


def log_weight(evidence: MeasuredData, model: FittedModel) -> float:
    """Logarithm of a model's posterior odds: its causes' prior odds, and evidence."""
    prior = sum(log_odds(evidence, hypothesis.cause) for hypothesis in model.hypotheses)
    return model.log_evidence / temperature(evidence) + prior


def probabilities(log_weights: Sequence[float]) -> np.ndarray:
    """Of hypotheses with these logarithms of posterior odds."""
    likely = np.exp(np.asarray(log_weights) - np.max(log_weights))
    return np.asarray(likely / likely.sum())


def smallest_set(names: Sequence[str], probability: np.ndarray) -> tuple[str, ...]:
    """The fewest names that together hold 95 %, the most probable first."""
    total: dict[str, float] = {}
    for name, p in zip(names, probability, strict=True):
        total[name] = total.get(name, 0.0) + float(p)
    chosen, held = [], 0.0
    for name, p in sorted(total.items(), key=lambda item: -item[1]):
        chosen.append(name)
        held += p
        if held >= SURE:
            break
    return tuple(chosen)
