"""A campaign in one table: what was named, how sure, how exactly, and from which size on."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.stats import binomtest

from twin.campaign.case import CaseResult
from twin.campaign.judgement import Outcome, covered, judge, named_first, resolved
from twin.campaign.limits import LIMITS

FOUND: tuple[Outcome, ...] = ("right", "in a set")


@dataclass(frozen=True, kw_only=True)
class CauseRow:
    """All cases of one hidden cause at one strength."""

    label: str
    strength: float
    cases: int
    outcomes: dict[str, int]
    """Number of cases by :data:`~twin.campaign.judgement.Outcome`."""
    found_95: tuple[float, float]
    """Wilson's 95 % interval of the share that was found."""
    followed: int
    resolved: int
    """Ambiguous cases whose proposed test was run on the same rig, and those it brought to the hidden cause."""
    extra: int
    """Cases with causes in the model that were not hidden."""
    inside: int
    intervals: int
    """True parameters inside their 95 % intervals, and how many there were."""
    gain: float | None
    oracle_ratio: float | None
    """Medians: error on the held-out sweep before over after, and after over the oracle's."""
    diagnosis_s: float | None
    """Median time of a diagnosis."""

    @property
    def found(self) -> int:
        """Cases in which the hidden cause was first, or in the set that the verdict calls indistinguishable."""
        return sum(self.outcomes.get(outcome, 0) for outcome in FOUND)


@dataclass(frozen=True, kw_only=True)
class Calibration:
    """Cases whose first cause was given a probability between two bounds."""

    low: float
    high: float
    cases: int
    mean_probability: float
    right: float


@dataclass(frozen=True, kw_only=True)
class CampaignSummary:
    """The whole campaign."""

    rows: tuple[CauseRow, ...]
    """By cause and strength."""
    confusion: dict[str, dict[str, int]]
    """For each hidden cause (single ones, and none) at full strength, how often each name came first."""
    calibration: tuple[Calibration, ...]
    parameters: dict[str, tuple[int, int]]
    """For each parameter, (inside, of) its 95 % intervals."""
    smallest: dict[str, float | None]
    """For each cause, the smallest strength at and above which it is found in nine of ten cases; None where it is not
    even at the largest."""


def summarise(results: Sequence[CaseResult]) -> CampaignSummary:
    """Count."""
    groups: dict[tuple[str, float], list[CaseResult]] = {}
    for result in results:
        groups.setdefault((result.plan.label, result.plan.strength), []).append(result)
    rows = tuple(_row(label, strength, groups[label, strength]) for label, strength in sorted(groups))
    return CampaignSummary(
        rows=rows,
        confusion=_confusion(results),
        calibration=_calibration(results),
        parameters=_parameters(results),
        smallest=_smallest(rows),
    )


def _row(label: str, strength: float, results: list[CaseResult]) -> CauseRow:
    outcomes: Counter[str] = Counter(judge(result) for result in results)
    found = sum(outcomes[outcome] for outcome in FOUND)
    interval = binomtest(found, len(results)).proportion_ci(method="wilson")
    inside = [ok for result in results for _, ok in covered(result)]
    diagnosed = [result.found for result in results if result.found]
    held = [(r, r.found["gain"]["held_out"]) for r in results if r.found and r.found["gain"]]
    after = [brought for result in results if (brought := resolved(result)) is not None]
    return CauseRow(
        label=label,
        strength=strength,
        cases=len(results),
        outcomes=dict(outcomes),
        found_95=(float(interval.low), float(interval.high)),
        followed=len(after),
        resolved=sum(after),
        extra=sum(not {c["cause"] for c in result.named} <= set(result.plan.causes) for result in results),
        inside=sum(inside),
        intervals=len(inside),
        gain=_median([h["before"] / h["after"] for _, h in held]),
        oracle_ratio=_median([h["after"] / r.oracle_after for r, h in held if r.oracle_after]),
        diagnosis_s=_median([found["seconds"] for found in diagnosed]),
    )


def _median(values: list[float]) -> float | None:
    return float(np.median(values)) if values else None


def _confusion(results: Sequence[CaseResult]) -> dict[str, dict[str, int]]:
    counts: dict[str, Counter[str]] = {}
    for result in results:
        if len(result.plan.causes) < 2 and result.plan.strength == 1.0:
            counts.setdefault(result.plan.label, Counter())[named_first(result)] += 1
    return {label: dict(counts[label]) for label in sorted(counts)}


def _calibration(results: Sequence[CaseResult]) -> tuple[Calibration, ...]:
    """Of cases with one hidden cause or none: a clean rig's false name is a wrong one."""
    pairs = [
        (float(r.named[0]["probability"]), judge(r) == "right") for r in results if len(r.plan.causes) < 2 and r.named
    ]
    out = []
    for low, high in pairwise(LIMITS.summary_bins):
        inside = [(p, right) for p, right in pairs if low < p <= high]
        if inside:
            mean, right = np.mean(inside, axis=0)
            out.append(
                Calibration(low=low, high=high, cases=len(inside), mean_probability=float(mean), right=float(right))
            )
    return tuple(out)


def _parameters(results: Sequence[CaseResult]) -> dict[str, tuple[int, int]]:
    counts: dict[str, list[bool]] = {}
    for result in results:
        for name, inside in covered(result):
            counts.setdefault(name, []).append(inside)
    return {name: (sum(counts[name]), len(counts[name])) for name in sorted(counts)}


def _smallest(rows: Sequence[CauseRow]) -> dict[str, float | None]:
    smallest: dict[str, float | None] = {}
    for label in dict.fromkeys(row.label for row in rows):
        if label == "none" or "+" in label:
            continue
        smallest[label] = None
        for row in sorted((row for row in rows if row.label == label), key=lambda row: -row.strength):
            if row.found < LIMITS.summary_power * row.cases:
                break
            smallest[label] = row.strength
    return smallest
