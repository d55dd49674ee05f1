"""Fits of rivals side by side: what a race does once its time is up."""

import time
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.selection import racing
from twin.identify.gauss_newton import Solution
from twin.identify.residuals.error_model import SOUND
from twin.identify.time_limit import time_limit

NONE = np.zeros(0)
FIT = FittedModel((), None, SOUND, Solution(NONE, 0.0, 0.0, NONE, NONE, NONE, (0.0,)), log_evidence=1.0, dof=1)


@pytest.mark.parametrize(("left_s", "fits"), [(60.0, [FIT, FIT]), (0.0, [])])
def test_no_last_fit_is_begun_once_the_time_is_up(left_s, fits, monkeypatch):
    """Each still takes its weights, its sensitivities and its errors, which of two joints are ten seconds."""
    monkeypatch.setattr(racing, "_with_own_law", lambda *given: given[2].baseline)
    monkeypatch.setattr(racing, "fit_with_errors", lambda *given, **options: FIT)
    mass = SimpleNamespace(cause=SimpleNamespace(parameters=lambda evidence, label: ()), label={})
    begun = [racing.Begun(None, (mass,), (SOUND,))] * 2
    with time_limit(time.monotonic() + left_s):
        assert racing.Race(None, None, None).run(begun) == fits


@pytest.mark.parametrize("ended", ["settled", "out of iterations"])
def test_a_leader_that_ran_out_of_iterations_is_begun_anew_without_tolerances(ended, monkeypatch):
    leader, other = (
        replace(FIT, log_evidence=size, solution=replace(FIT.solution, ended=ended)) for size in (2.0, 1.0)
    )
    last = iter([other, leader])
    monkeypatch.setattr(racing, "_with_own_law", lambda *given: given[2].baseline)
    monkeypatch.setattr(racing, "fit_with_errors", lambda *given, **options: next(last))
    monkeypatch.setattr(racing, "fit_without_first", lambda evidence, harmonics, model, tolerances: ("anew", model))
    mass = SimpleNamespace(cause=SimpleNamespace(parameters=lambda evidence, label: ()), label={})
    fits = racing.Race(None, None, None).run([racing.Begun(None, (mass,), (SOUND,))] * 2)
    assert fits == [other, leader, *([] if ended == "settled" else [("anew", leader)])]
