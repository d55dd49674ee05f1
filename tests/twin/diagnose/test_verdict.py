"""What may be said of a search: what holds 95 % of the probability by itself, else that it cannot be told."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE, LOG_ODDS_OF_UNKNOWN
from twin.diagnose.selection.search import Search, Stage
from twin.diagnose.verdict import decide, named_causes, posterior_of, rivals_of
from twin.identify.residuals.error_model import SOUND

FINDING = SimpleNamespace(
    cause="clipping", summary="", names={"channel": "acc1"}, values={"level": 3.0}, std={"level": 0.1}
)
FAR = 10 * LIMITS.posterior_temperature
"""Gain of log evidence that leaves no doubt, beside what one more cause costs."""


def paid(gain):
    """A gain of log evidence beyond what one more cause costs beforehand."""
    return gain - LIMITS.posterior_temperature * LOG_ODDS_OF_A_CAUSE


def model(*names, evidence):
    """A model with causes of these names, and its log evidence."""
    hypotheses = tuple(
        CauseHypothesis(
            cast(Any, SimpleNamespace(
                name=name, summary=f"{name} acts", labels=lambda evidence: ({},),
                reported=lambda values, std: (values, std),
            )),
            {}, {"size": 2.0}, {"size": 0.1},
        )
        for name in names
    )  # fmt: skip
    return FittedModel(hypotheses, cast(Any, None), SOUND, cast(Any, None), evidence, 100)


def stage(before, *rivals, unknown=-1e3):
    """A turn that takes the first of the rivals where it is more probable than the model without."""
    accepted = (
        bool(rivals)
        and rivals[0].log_evidence + LIMITS.posterior_temperature * LOG_ODDS_OF_A_CAUSE > before.log_evidence
    )
    return Stage(before, (), rivals, accepted, unknown, cast("Any", None))


def search(*stages):
    last = stages[-1]
    found = last.rivals[0] if last.accepted else last.before
    return Search(stages[0].before, found, stages, cast(Any, None), None, None)


BASE = model(evidence=0.0)


def verdict(*stages, findings=()):
    return decide(posterior_of(search(*stages)), list(findings))


def test_nothing_is_named_where_no_cause_is_more_probable():
    assert verdict(stage(BASE, model("a", evidence=paid(-FAR)))) == "none"
    assert verdict(stage(BASE)) == "none"


def test_a_cause_far_ahead_of_its_rivals_explains():
    best = model("a", evidence=paid(FAR))
    assert verdict(stage(BASE, best, model("b", evidence=paid(0.0))), stage(best)) == "explained"


def test_a_cause_that_is_about_as_probable_as_none_is_ambiguous():
    best = model("a", evidence=paid(LIMITS.posterior_temperature))
    assert verdict(stage(BASE, best), stage(best)) == "ambiguous"


def test_rivals_that_share_the_probability_are_told_with_what_each_has():
    gains = {"a": FAR + 0.01, "b": FAR, "c": -FAR}
    best, other, far = (model(name, evidence=paid(gain)) for name, gain in gains.items())
    turns = search(stage(BASE, best, other, far), stage(best))
    posterior = posterior_of(turns)
    assert posterior.set_95 == ("a", "b")
    assert decide(posterior, []) == "ambiguous"
    assert [rival.name for rival in rivals_of(posterior)] == ["b"]
    named = named_causes(turns, posterior, [], "ambiguous")
    assert [(n.cause, n.in_model, n.confused_with) for n in named] == [("a", True, ("b",)), ("b", False, ())]
    assert [n.probability for n in named] == pytest.approx([0.5, 0.5], abs=1e-3)
    assert (named[0].parameters["size"].value, named[0].parameters["size"].std) == (2.0, 0.1)


@pytest.mark.parametrize("names", [(), ("a",)], ids=["beside none", "beside a cause"])
def test_a_model_that_must_be_wrong_by_more_than_sound_rigs_is_unknown(names):
    """With or without a cause: errors of any size make the data far more probable."""
    best = model(*names, evidence=paid(FAR) if names else 0.0)
    unknown = best.log_evidence - LIMITS.posterior_temperature * LOG_ODDS_OF_UNKNOWN + FAR
    turns = (
        (stage(BASE, best, unknown=unknown), stage(best, unknown=unknown)) if names else (stage(BASE, unknown=unknown),)
    )
    assert verdict(*turns) == "unknown"
    assert not [n for n in named_causes(search(*turns), posterior_of(search(*turns)), [], "unknown") if n.in_model]


def test_what_recordings_reduced_against_a_model_far_off_lack_is_not_unknown():
    """The stage that chose a cause has data reduced without it; the next one has them reduced with it."""
    rough, exact = model("a", evidence=paid(FAR)), model("a", evidence=2 * FAR)
    assert verdict(stage(BASE, rough, unknown=paid(3 * FAR)), stage(exact, unknown=2 * FAR)) == "explained"
    assert verdict(stage(BASE, rough, unknown=paid(FAR)), stage(exact, unknown=4 * FAR)) == "unknown"


def test_of_two_causes_the_turn_that_chose_the_last_is_weighed():
    """What rivalled the first alone is a rival no more."""
    first, both = model("a", evidence=paid(FAR)), model("a", "b", evidence=2 * paid(FAR))
    turns = search(stage(BASE, first, model("b", evidence=paid(FAR))), stage(first, both), stage(both))
    posterior = posterior_of(turns)
    assert posterior.set_95 == ("a + b",)
    assert decide(posterior, []) == "explained"
    named = named_causes(turns, posterior, [], "explained")
    assert {(n.cause, n.in_model, n.confused_with) for n in named} == {("a", True, ()), ("b", True, ())}


def test_what_the_samples_show_is_an_explanation_where_nothing_else_is_missing():
    assert verdict(stage(BASE), findings=[FINDING]) == "explained"
    assert verdict(stage(BASE, unknown=1e3), findings=[FINDING]) == "unknown"
    (named,) = named_causes(search(stage(BASE)), posterior_of(search(stage(BASE))), [FINDING], "explained")
    assert (named.cause, named.in_model, named.parameters["level"].value) == ("clipping", True, 3.0)
