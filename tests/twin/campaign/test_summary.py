"""A campaign's table counts what was named beside what was hidden."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from twin.campaign import CasePlan, CaseResult, judge, planned_cases, summarise
from twin.campaign.judgement import resolved
from twin.views.campaign_figures import confusion_figure, detection_figure


def case(
    hidden: tuple[str, ...],
    named: tuple[str, ...],
    *,
    verdict: str = "explained",
    confused: tuple[str, ...] = (),
    strength: float = 1.0,
    probability: float = 0.97,
    estimate: float = 1.0,
    std: float = 0.1,
    seed: int = 1,
) -> CaseResult:
    """A finished case; every hidden parameter is `size`, and one."""
    causes: list[dict[str, Any]] = [
        {
            "cause": name,
            "in_model": True,
            "probability": probability,
            "confused_with": list(confused),
            "parameters": {"size": {"value": estimate, "std": std}, "channel": "acc1"},
        }
        for name in named
    ]
    return CaseResult(
        plan=CasePlan(seed, hidden, strength),
        rig="steel-lap-joint",
        hidden=[{"cause": name, "parameters": {"size": 1.0, "channel": "acc1"}} for name in hidden],
        found={
            "verdict": verdict if named else ("none" if verdict == "explained" else verdict),
            "causes": causes,
            "gain": {"held_out": {"before": 0.1, "after": 0.01, "noise_floor": 0.01}},
            "seconds": 20.0,
        },
        oracle_after=0.008,
        aborted=[],
        recording_s=5.0,
    )


FAILED = CaseResult(
    plan=CasePlan(1, ("a",)), rig="r", hidden=[], found=None, aborted=[], recording_s=0.0, error="ValueError: no"
)


@pytest.mark.parametrize(
    ("result", "expected"),
    [
        (case(("a",), ("a",)), "right"),
        (case(("a",), ("a", "b")), "right"),
        (case(("a",), ("b", "a")), "wrong"),
        (case(("a",), ("b",)), "wrong"),
        (case(("a",), ("b",), verdict="ambiguous", confused=("a",)), "in a set"),
        (case(("a",), ("b",), verdict="ambiguous", confused=("c",)), "wrong"),
        # Rivals that a confident verdict mentions do not count.
        (case(("a",), ("b",), confused=("a",)), "wrong"),
        (case(("a",), ()), "none"),
        (case(("a",), (), verdict="unknown"), "unknown"),
        (case((), ()), "right"),
        (case((), ("a",)), "wrong"),
        (case(("a", "b"), ("b", "a")), "right"),
        (case(("a", "b"), ("b",)), "partly"),
        (case(("a", "b"), ("c",)), "wrong"),
        (FAILED, "failed"),
    ],
)
def test_outcomes(result, expected):
    assert judge(result) == expected


def test_an_overload_that_the_converter_counted_is_no_false_name():
    """The same clipping on a channel that never reached its limit is one."""
    assert judge(replace(case((), ("clipping",)), overloaded=("acc1",))) == "right"
    assert judge(replace(case(("a",), ("clipping", "a")), overloaded=("acc1",))) == "right"
    assert judge(replace(case(("a",), ("clipping",)), overloaded=("acc1",))) == "none"
    assert judge(replace(case((), ("clipping",)), overloaded=("force",))) == "wrong"
    assert judge(replace(case(("clipping",), ("clipping",)), overloaded=("acc1",))) == "right"


def test_counts_intervals_and_gains():
    results = [
        case(("a",), ("a",)),
        case(("a",), ("a",), estimate=1.5),
        case(("a",), ("a", "b"), estimate=1.15),
        case(("a",), ("b",)),
        FAILED,
    ]
    (row,) = summarise(results).rows
    assert (row.cases, row.found, row.extra) == (5, 3, 2)
    assert row.outcomes == {"right": 3, "wrong": 1, "failed": 1}
    # A parameter of a cause that was not named has no interval; one estimate is five deviations off.
    assert (row.inside, row.intervals) == (2, 3)
    assert row.gain == pytest.approx(10)
    assert row.oracle_ratio == pytest.approx(1.25)
    # Wilson's interval of three in five.
    assert row.found_95 == pytest.approx((0.2307, 0.8824), abs=1e-4)


def test_the_test_that_was_proposed_counts_by_what_it_brought():
    doubtful = case(("a",), ("b",), verdict="ambiguous", confused=("a",))
    brought = {
        "the cause": case(("a",), ("a",)).found,
        "another": case(("a",), ("b",)).found,
        "no answer": case(("a",), ("a",), verdict="ambiguous", confused=("b",)).found,
    }
    results = [replace(doubtful, followed=found) for found in brought.values()]
    assert [resolved(result) for result in results] == [True, False, False]
    assert resolved(doubtful) is None
    (row,) = summarise([*results, doubtful]).rows
    assert (row.followed, row.resolved, row.found) == (3, 1, 4)


def test_confusion_counts_what_came_first():
    summary = summarise([case(("a",), ("b",)), case(("a",), ("a", "b")), case((), ()), case((), ("a",))])
    assert summary.confusion == {"a": {"b": 1, "a": 1}, "none": {"none": 1, "a": 1}}


def test_calibration_sorts_by_the_probability_that_was_said():
    sure = [case(("a",), ("a",), probability=0.999)] * 3 + [case(("a",), ("b",), probability=0.999)]
    unsure = [case(("a",), ("a",), probability=0.6), case((), ("a",), probability=0.6)]
    low, high = summarise([*sure, *unsure]).calibration
    assert (low.cases, low.right) == (2, 0.5)
    assert (high.cases, high.right) == (4, 0.75)


def test_the_smallest_detectable_strength_has_all_larger_ones_found():
    found = {1.0: 10, 0.5: 9, 0.3: 6, 0.1: 10}
    results = [
        case(("a",), ("a",) if seed < count else (), strength=strength, seed=seed)
        for strength, count in found.items()
        for seed in range(10)
    ]
    assert summarise(results).smallest == {"a": 0.5}
    assert summarise([case(("a",), ())]).smallest == {"a": None}


def test_plans_go_through_all_causes_before_the_next_seed():
    plans = planned_cases(causes=("a", "none", "b"), seeds=(5, 6), strengths=(1.0, 0.3), pairs=3)
    assert [plan.name for plan in plans[:5]] == ["a-1-5", "a-0.3-5", "none-1-5", "b-1-5", "b-0.3-5"]
    assert [plan.label for plan in plans[10:]] == ["a+b"] * 3
    assert len({plan.name for plan in plans}) == len(plans)


def test_results_survive_json():
    result = case(("a", "b"), ("a",))
    assert CaseResult.from_dict(result.to_dict()) == result


def test_pictures_show_every_count():
    results = [case(("a",), ("a",)), case(("a",), ("b",)), case(("b",), ("b",), strength=0.3), case((), ())]
    summary = summarise(results)
    (axes,) = confusion_figure(summary).axes
    assert sorted(text.get_text() for text in axes.texts) == ["1", "1", "1"]
    (axes,) = detection_figure(summary).axes
    assert sorted(text.get_text() for text in axes.texts) == ["1/1", "1/2"]
