"""Probabilities of hypotheses, and the fewest that hold 95 % of it."""

from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose.limits import LIMITS
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE, log_weight, probabilities, smallest_set


def test_probabilities_are_the_odds_over_their_sum_however_large_their_logarithms():
    odds = np.array([1.0, 3.0, 6.0])
    assert probabilities(np.log(odds) + 5e4) == pytest.approx(odds / 10)


@pytest.mark.parametrize(
    ("probability", "expected"),
    [
        ([0.96, 0.03, 0.01], ("a",)),
        ([0.03, 0.01, 0.96], ("none",)),
        ([0.50, 0.40, 0.10], ("a", "b", "none")),
        ([0.30, 0.66, 0.04], ("b", "a")),
    ],
)
def test_the_set_is_the_smallest_that_holds_95_percent_the_most_probable_first(probability, expected):
    assert smallest_set(["a", "b", "none"], np.array(probability)) == expected


def test_a_cause_at_two_places_counts_once_with_both():
    assert smallest_set(["a", "b", "a"], np.array([0.5, 0.04, 0.46])) == ("a",)


def test_every_cause_costs_its_prior_odds_shared_out_among_its_labels():
    """Four channels that could each be at fault are no likelier than one clamp."""

    def hypothesis(labels):
        return SimpleNamespace(cause=SimpleNamespace(labels=lambda evidence: [{}] * labels))

    model = SimpleNamespace(log_evidence=12.0, hypotheses=(hypothesis(1), hypothesis(4)))
    expected = 12.0 / LIMITS.posterior_temperature + 2 * LOG_ODDS_OF_A_CAUSE - np.log(4)
    assert log_weight(None, model) == pytest.approx(expected)
