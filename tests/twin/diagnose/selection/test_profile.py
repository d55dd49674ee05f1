"""The likeliest threshold is found among many maxima, whichever the fit began in."""

from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose.cause import Parameter, thresholds
from twin.diagnose.selection import profile

GAP = Parameter(name="gap_m", scale=1.0, lower=1e-3, upper=2.0, starts=thresholds(1.0, least=0.05))
TRUE = 0.35


@dataclass(frozen=True)
class Hypothesis:
    values: dict[str, float]


@dataclass(frozen=True)
class Fit:
    hypotheses: tuple[Hypothesis, ...]
    cost: float
    baseline: None = None
    errors: None = None

    @property
    def solution(self):
        return SimpleNamespace(cost=self.cost)


def cost(gap):
    """Maxima half as far again apart, the highest at the true gap, and barriers of some per cent."""
    away = np.log(gap / TRUE)
    return 1000 * (1 + 0.02 * away**2 - 0.05 * np.cos(12 * away) * np.exp(-2 * away**2))


@pytest.fixture
def tried(monkeypatch):
    """Values that were tried; what a fit costs at each is :func:`cost`."""
    values = []

    def fit_model(evidence, harmonics, baseline, hypotheses, *, options, **others):
        cause, name = options.held
        value = hypotheses[cause].values[name]
        values.append(value)
        return Fit(hypotheses, cost(value))

    monkeypatch.setattr(profile, "fit_model", fit_model)
    return values


@pytest.mark.parametrize("start", [0.05, 0.2, 0.35, 0.6, 1.1, 1.9])
def test_the_highest_maximum_is_found_from_wherever_a_fit_ended(tried, start):
    found = profile.highest_of_profile(None, None, Fit((Hypothesis({"gap_m": start}),), cost(start)), GAP, None)
    assert found.hypotheses[-1].values["gap_m"] == pytest.approx(TRUE, rel=0.03)


def test_one_fit_that_leads_nowhere_does_not_end_a_direction(tried, monkeypatch):
    sound = profile.fit_model

    def fails_at_times(*given, **options):
        fit = sound(*given, **options)
        return replace(fit, cost=1e9) if len(tried) % 3 == 0 else fit

    monkeypatch.setattr(profile, "fit_model", fails_at_times)
    found = profile.highest_of_profile(None, None, Fit((Hypothesis({"gap_m": 1.1}),), cost(1.1)), GAP, None)
    assert found.solution.cost < cost(1.1)
    assert min(tried) < TRUE


def test_a_direction_is_left_where_the_cost_only_grows(tried, monkeypatch):
    monkeypatch.setattr(profile, "fit_model", lambda *given, **options: Fit(given[3], 1000 * (1 + len(tried))))
    found = profile.highest_of_profile(None, None, Fit((Hypothesis({"gap_m": 0.3}),), 10.0), GAP, None)
    assert found.hypotheses[-1].values["gap_m"] == 0.3


def test_values_stay_where_the_causes_fits_begin(tried):
    profile.highest_of_profile(None, None, Fit((Hypothesis({"gap_m": 0.3}),), cost(0.3)), GAP, None)
    assert min(tried) >= min(GAP.starts) / 1.4
    assert max(tried) <= 1.4 * max(GAP.starts)
