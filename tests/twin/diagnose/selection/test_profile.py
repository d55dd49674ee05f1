"""The likeliest threshold is found among many maxima, with a model error that widens them and then with less."""

from dataclasses import dataclass
from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose.cause import Parameter, thresholds
from twin.diagnose.limits import LIMITS
from twin.diagnose.selection import racing
from twin.identify.residuals.error_model import SOUND, ErrorModel, continuation

GAP = Parameter(name="gap_m", scale=1.0, lower=1e-3, upper=2.0, starts=thresholds(1.0, least=0.05))
TRUE = 0.35
LEVELS = [level for level in continuation(SOUND) if level.steps.stiffness < LIMITS.search_follows]


@dataclass(frozen=True)
class Hypothesis:
    values: dict[str, float]
    label: str = ""
    key: str = "joint-slap"

    @property
    def cause(self):
        return SimpleNamespace(parameters=lambda evidence, label: (GAP,))

    @property
    def std(self):
        return {"gap_m": 0.01 * self.values["gap_m"]}


@dataclass(frozen=True)
class Fit:
    hypotheses: tuple[Hypothesis, ...]
    cost: float
    errors: ErrorModel
    log_evidence: float = 0.0
    baseline: None = None

    @property
    def solution(self):
        return SimpleNamespace(cost=self.cost, settled=True)


def cost(gap, stiffness):
    """Maxima a third apart, the highest at the true gap; the larger the model error, the less of them is told."""
    away = np.log(gap / TRUE)
    ripples = min(1.0, LEVELS[-1].steps.stiffness / stiffness)
    return 1000 * (1 + 0.05 * away**2 - 0.01 * ripples * np.cos(2 * np.pi * away / np.log(1.35)))


@pytest.fixture
def tried(monkeypatch):
    """(Model error, gap) of each fit that holds it; one that is free ends in the maximum nearest by."""
    fits = []

    def fit_model(evidence, harmonics, baseline, hypotheses, *, errors, tolerances, options):
        gap = hypotheses[-1].values["gap_m"]
        assert options.held == (len(hypotheses) - 1, "gap_m")
        fits.append((errors.steps.stiffness, gap))
        return Fit(hypotheses, cost(gap, errors.steps.stiffness), errors)

    def fit_with_errors(evidence, harmonics, baseline, hypotheses, *, tolerances, errors=LEVELS[-1]):
        gap = hypotheses[-1].values["gap_m"]
        near = TRUE * 1.35 ** np.round(np.log(gap / TRUE) / np.log(1.35))
        least = cost(near, errors.steps.stiffness)
        return Fit((*hypotheses[:-1], Hypothesis({"gap_m": float(near)})), least, errors, log_evidence=-least / 2)

    monkeypatch.setattr(racing, "_with_own_law", lambda *given: given[2].baseline)
    monkeypatch.setattr(racing, "fit_model", fit_model)
    monkeypatch.setattr(racing, "fit_with_errors", fit_with_errors)
    return fits


def found_from(gap, levels=LEVELS):
    begun = racing.Begun(None, (Hypothesis({"gap_m": gap}),), tuple(levels))
    return racing.Race(None, None, None).run([begun])[0].hypotheses[-1].values["gap_m"]


@pytest.mark.parametrize("start", GAP.starts)
def test_the_highest_maximum_is_found_from_wherever_a_search_begins(tried, start):
    assert found_from(start) == pytest.approx(TRUE, rel=1e-6)


def test_the_smallest_model_error_alone_would_not_find_it(tried):
    """Else the test above could not fail: the grid misses its maxima, and one beside the highest may lie on it."""
    assert any(found_from(start, LEVELS[-1:]) != pytest.approx(TRUE, rel=1e-6) for start in GAP.starts)


def test_values_are_tried_over_the_whole_range_once_and_then_finer_about_the_best(tried):
    found_from(0.3)
    first, *others = ([gap for stiffness, gap in tried if stiffness == level.steps.stiffness] for level in LEVELS)
    assert min(first) < 1.4 * min(GAP.starts)
    assert max(first) > max(GAP.starts) / 1.4
    ratio, best = LIMITS.cause_ratio, min(first, key=lambda gap: cost(gap, LEVELS[0].steps.stiffness))
    for level, gaps in zip(LEVELS[1:], others, strict=True):
        ratio **= 0.5
        assert gaps[0] == best
        assert np.exp(np.ptp(np.log(gaps))) <= ratio**2 * (1 + 1e-9)
        best = min(gaps, key=lambda gap: cost(gap, level.steps.stiffness))


def test_a_threshold_stays_where_it_began_while_the_model_does_not_follow_the_data(tried):
    loose = [level for level in continuation(SOUND) if level not in LEVELS]
    found_from(0.2, (*loose, *LEVELS))
    assert [gap for stiffness, gap in tried if stiffness > LIMITS.search_follows] == [0.2] * len(loose)


def test_a_direction_is_left_where_two_values_in_a_row_lead_nowhere(tried, monkeypatch):
    def steep(gap, stiffness):
        return 1000 * (1 + 0.5 * np.log(gap / TRUE) ** 2)

    monkeypatch.setitem(globals(), "cost", steep)
    found_from(TRUE, LEVELS[:1] * 2)
    far = sorted({gap for _, gap in tried})
    beyond = [gap for gap in far if steep(gap, 0.0) > LIMITS.profile_hopeless * 1000]
    assert len([gap for gap in beyond if gap < TRUE]) <= 2
    assert len([gap for gap in beyond if gap > TRUE]) <= 2
    assert min(far) > min(GAP.starts)
