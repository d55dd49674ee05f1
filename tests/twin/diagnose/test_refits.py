"""A fit and its model errors are found from each other, in turn, until nothing is gained by it."""

from itertools import cycle
from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose import model_evidence
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import fit_with_errors
from twin.identify.residuals.error_model import SOUND

HERE, THERE = (SOUND.with_log_sizes(SOUND.log_sizes + off) for off in (0.0, 1.0))


@pytest.fixture
def turns(monkeypatch):
    """Makes fits of nothing, whose errors and log evidence are given in turn; returns how each was allowed to err."""

    def given(inferred):
        left, begun = iter(inferred), []
        solution = SimpleNamespace(ended="settled", settled=True)
        model = FittedModel((), baseline=None, errors=None, solution=solution, log_evidence=np.nan, dof=0)

        def fit(*where, errors, **how):
            begun.append(errors)
            return model

        monkeypatch.setattr(model_evidence, "sound_errors", lambda evidence: SOUND)
        monkeypatch.setattr(model_evidence, "fit_model", fit)
        monkeypatch.setattr(model_evidence, "FitProblem", lambda *where, **how: None)
        monkeypatch.setattr(model_evidence, "infer_errors", lambda *about: next(left))
        return begun

    return given


def test_a_fit_whose_errors_are_those_it_was_made_with_is_the_last(turns):
    begun = turns([(HERE, 5.0)])
    assert fit_with_errors(None, None, None, (), errors=HERE).log_evidence == 5.0
    assert len(begun) == 1


def test_errors_with_two_maxima_that_lead_to_each_other_end_where_nothing_is_gained(turns):
    begun = turns(cycle([(THERE, 5.0), (HERE, 3.0)]))
    found = fit_with_errors(None, None, None, (), errors=HERE)
    assert found.log_evidence == 5.0
    assert begun == [HERE, THERE]


def test_fits_go_on_while_they_gain_but_not_for_ever(turns):
    begun = turns((errors, float(n)) for n, errors in enumerate(cycle([THERE, HERE])))
    assert fit_with_errors(None, None, None, (), errors=HERE).log_evidence == LIMITS.model_evidence_refitted - 1
    assert len(begun) == LIMITS.model_evidence_refitted
