"""What may be said of a search: a cause that leaves a part of the evidence unexplained is no explanation."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from twin.diagnose.fitted_model import CauseHypothesis
from twin.diagnose.verdict import decide, named_causes

FINDING = [SimpleNamespace(cause="clipping")]


def search(before, after, named=True, frequency_discrepancy=(1e-5, -4e-5)):
    """A search whose base family and model leave these chi2 per number in each part, its frequencies these."""
    baseline = SimpleNamespace(base=SimpleNamespace(frequency_discrepancy=np.array(frequency_discrepancy)))
    hypothesis = SimpleNamespace(key="a", cause=SimpleNamespace(name="a"))
    finalist = SimpleNamespace(hypotheses=(hypothesis,), weight=lambda overdispersion: 0.0, chi2_per_dof=1.0)

    def model(parts, hypotheses):
        mean = sum(parts.values()) / len(parts)
        return SimpleNamespace(chi2_per_number=parts, chi2_per_dof=mean, hypotheses=hypotheses, baseline=baseline)

    return SimpleNamespace(
        base=model(before, ()),
        model=model(after, (hypothesis,) if named else ()),
        stages=(SimpleNamespace(accepted=True, finalists=(finalist,)),),
    )


@pytest.mark.parametrize(
    ("before", "after", "verdict"),
    [
        ({"steps": 60.0, "harmonics": 0.5}, {"steps": 0.7, "harmonics": 0.5}, "explained"),
        # All harmonics that the cause should have made are still there, in few numbers beside the rest.
        ({"steps": 0.5, "harmonics": 2.1}, {"steps": 0.5, "harmonics": 1.7}, "unknown"),
        # Ten grams found as ten, from dwells that were a little short.
        ({"steps": 42.0, "harmonics": 0.4}, {"steps": 5.3, "harmonics": 0.4}, "explained"),
        ({"steps": 60.0, "harmonics": 5.0}, {"steps": 4.2, "harmonics": 3.4}, "unknown"),
    ],
)
def test_every_part_of_the_evidence_must_be_explained(before, after, verdict):
    assert decide(search(before, after), []) == verdict


@pytest.mark.parametrize(
    ("frequency_discrepancy", "verdict"), [((3e-5, -7e-4), "explained"), ((3e-5, -2e-3), "unknown")]
)
def test_a_frequency_that_no_parameter_explains_is_not_explained(frequency_discrepancy, verdict):
    """However well the fit follows the data by shifting it."""
    assert decide(search({"steps": 60.0}, {"steps": 0.7}, frequency_discrepancy=frequency_discrepancy), []) == verdict


def test_without_a_cause_a_poor_fit_is_unknown_and_a_good_one_is_nothing():
    assert decide(search({"steps": 8.0}, {"steps": 8.0}, named=False), []) == "unknown"
    assert decide(search({"steps": 0.6}, {"steps": 0.6}, named=False), []) == "none"


def test_what_the_samples_show_is_an_explanation_of_a_fit_that_is_not_poor():
    assert decide(search({"steps": 2.2}, {"steps": 2.2}, named=False), FINDING) == "explained"
    assert decide(search({"steps": 900.0}, {"steps": 900.0}, named=False), FINDING) == "unknown"


def test_a_rival_of_one_stage_that_the_next_takes_as_well_is_a_rival_no_more():
    """Both act: while only the first was in the model, the second explained the data nearly as well."""
    hypotheses = {
        name: CauseHypothesis(
            SimpleNamespace(name=name, summary=name, reported=lambda values, std: (values, std)), {}, {}, {}
        )
        for name in "abc"
    }

    def finalist(*names, evidence):
        return SimpleNamespace(
            hypotheses=tuple(hypotheses[n] for n in names), weight=lambda overdispersion: evidence, chi2_per_dof=1.0
        )  # fmt: skip

    first = tuple(finalist(n, evidence=e) for n, e in (("a", 0.0), ("b", 0.0), ("c", 0.0)))
    second = (finalist("a", "b", evidence=0.0),)
    stages = [SimpleNamespace(accepted=True, finalists=finalists) for finalists in (first, second)]
    named = named_causes(SimpleNamespace(model=second[0], stages=stages, evidence=None), [], "explained")
    assert [(n.cause, n.in_model, n.confused_with) for n in named] == [
        ("b", True, ()), ("a", True, ("c",)), ("c", False, ("a",)),
    ]  # fmt: skip
    assert [n.probability for n in named] == pytest.approx([0.999, 0.5, 0.5])
