"""The ascent's turns, with the searches and fits themselves left out."""

from types import SimpleNamespace
from typing import Any, cast

import pytest

from twin.diagnose import forward_selection
from twin.diagnose.forward_selection import ForwardSelection


def fit(key: str, log_evidence: float) -> Any:
    """As much of a candidate as a turn looks at."""
    hypotheses = (SimpleNamespace(key=key),) if key else ()
    solution = SimpleNamespace(chi2=-log_evidence)
    return SimpleNamespace(
        hypotheses=hypotheses,
        log_evidence=log_evidence,
        solution=solution,
        baseline=key or "elsewhere",
        chi2_per_dof=1.0,
    )


@pytest.fixture
def ascent(monkeypatch):
    """One whose base family has a far better minimum than where it begins; its turns tell what they were given."""
    found, better = fit("drift", -10.0), fit("", -100.0)
    turns = []

    def finalists(scores, kept):
        turns.append(kept)
        return [found] if len(turns) == 1 else [*kept, fit("mass", -90.0)]

    made = ForwardSelection.__new__(ForwardSelection)
    made.base = made.model = fit("", -1000.0)
    made._settled, made._left_behind, made._start = -1, 0.0, cast(Any, "here")
    made.evidence, made.harmonics = cast(Any, None), None
    monkeypatch.setattr(made, "_scores", list)
    monkeypatch.setattr(made, "_finalists", finalists)
    monkeypatch.setattr(forward_selection, "_anew", lambda *_: better)
    monkeypatch.setattr(forward_selection, "acceptance", lambda _, rivals, model, expected_residual_chi2: tuple(rivals))
    return made, found, better, turns


def test_what_was_found_is_a_rival_still_when_the_search_begins_again(ascent):
    made, found, better, turns = ascent
    stage = made._look_further()
    assert turns == [(), (found,)]
    assert made.base is made.model is better
    assert made._start == better.baseline
    assert stage.finalists[0] is found
    assert stage.accepted


def test_a_search_begins_again_once_at_most(ascent):
    made, _, _, turns = ascent
    made._look_further()
    made._look_further()
    assert len(turns) == 3
