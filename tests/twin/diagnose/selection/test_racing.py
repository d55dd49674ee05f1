"""Fits of rivals side by side: which end early, and what a race does once its time is up."""

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose import model_evidence
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.model_evidence import settled_fit
from twin.diagnose.selection import racing
from twin.identify.gauss_newton import Solution
from twin.identify.residuals.error_model import SOUND
from twin.identify.time_limit import time_limit

NONE = np.zeros(0)
FIT = FittedModel((), None, SOUND, Solution(NONE, 0.0, 0.0, NONE, NONE, NONE, (0.0,)), log_evidence=1.0, dof=1)


def fit_of(name: str, cost: float, **other) -> FittedModel:
    """A fit that ended at some cost."""
    cause = SimpleNamespace(parameters=lambda evidence, label: ())
    hypothesis = SimpleNamespace(cause=cause, label={}, key=name, std={})
    return replace(FIT, hypotheses=(hypothesis,), solution=replace(FIT.solution, chi2=cost), **other)


@pytest.fixture
def race_of(monkeypatch):
    """Races fits that all are at one model error, a sound rig's, and whose own errors take nothing."""

    def race(*fits):
        at = iter(fits)
        monkeypatch.setattr(racing, "_with_own_law", lambda *given: given[2].baseline)
        monkeypatch.setattr(racing, "fit_model", lambda *given, **options: next(at))
        by_key = {fit.hypotheses[0].key: fit for fit in fits}
        monkeypatch.setattr(racing, "fit_with_errors", lambda *given, **options: by_key[given[3][0].key])
        begun = [racing.Begun(None, fit.hypotheses, (SOUND,)) for fit in fits]
        return racing.Race(None, None, None).run(begun)

    return race


@pytest.mark.parametrize(("left_s", "count"), [(60.0, 2), (0.0, 0)])
def test_no_fit_is_begun_once_the_time_is_up(left_s, count, race_of):
    """Each still takes its weights, its sensitivities and its errors, which of two joints are ten seconds."""
    with time_limit(time.monotonic() + left_s):
        assert len(race_of(fit_of("mass", 1.0), fit_of("spring", 1.0))) == count


@pytest.mark.parametrize(("cost", "left"), [(140.0, ["mass", "spring"]), (160.0, ["mass"])])
def test_what_is_far_behind_with_a_sound_rigs_errors_is_given_no_errors_of_its_own(cost, left, race_of):
    fits = race_of(fit_of("mass", 100.0), fit_of("spring", cost))
    assert [fit.hypotheses[0].key for fit in fits] == left


def test_only_the_leader_is_begun_anew(race_of, monkeypatch):
    monkeypatch.setattr(racing, "settled_fit", lambda evidence, harmonics, fit, tolerances: replace(fit, dof=7))
    fits = race_of(fit_of("mass", 100.0, log_evidence=1.0), fit_of("spring", 100.0, log_evidence=2.0))
    assert [(fit.hypotheses[0].key, fit.dof) for fit in fits] == [("mass", 1), ("spring", 7)]


@pytest.mark.parametrize(
    ("ended", "before", "anew", "evidence", "begun_anew"),
    [
        ("settled", False, 2.0, 1.0, False),
        ("out of iterations", False, 2.0, 2.0, True),
        ("stuck", False, 0.5, 1.0, True),
        ("stuck", True, 2.0, 1.0, True),
    ],
)
def test_what_did_not_settle_is_begun_anew_without_tolerances_once(
    ended, before, anew, evidence, begun_anew, monkeypatch
):
    fit = fit_of("mass", 1.0, begun_anew=before)
    fit = replace(fit, solution=replace(fit.solution, ended=ended))
    monkeypatch.setattr(model_evidence, "fit_model", lambda *given, **options: fit)
    monkeypatch.setattr(
        model_evidence, "fit_with_errors", lambda *given, **options: fit_of("mass", 1.0, log_evidence=anew)
    )
    found = settled_fit(None, None, fit, None)
    assert (found.log_evidence, found.begun_anew) == (evidence, begun_anew)
