"""The few numbers of the rule, learnt from one part of a campaign and judged on the other.

A hypothesis' probability is made of its log evidence over a temperature, of the odds of a cause beforehand, and of
those of something on no list.  Learnt are the three at which the truth is most probable on the whole (the logarithmic
score), beside a wide prior about those that are in use; and what clean rigs needed as a model error.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import minimize

from twin.arrays import Array
from twin.campaign.case import CaseResult
from twin.campaign.limits import LIMITS
from twin.diagnose.limits import LIMITS as DIAGNOSE
from twin.diagnose.models import CAUSES
from twin.diagnose.posterior import LOG_ODDS_OF_A_CAUSE, LOG_ODDS_OF_UNKNOWN, Weighed, probabilities, smallest_set


@dataclass(frozen=True, kw_only=True)
class RuleNumbers:
    """What turns log evidence into probabilities."""

    temperature: float = DIAGNOSE.posterior_temperature
    log_odds_of_a_cause: float = LOG_ODDS_OF_A_CAUSE
    log_odds_of_unknown: float = LOG_ODDS_OF_UNKNOWN

    def probabilities(self, hypotheses: Sequence[Weighed]) -> Array:
        """Of hypotheses about the same data, (h,)."""
        more_of_a_cause = self.log_odds_of_a_cause - LOG_ODDS_OF_A_CAUSE
        more_of_unknown = self.log_odds_of_unknown - LOG_ODDS_OF_UNKNOWN
        return probabilities([
            h.log_evidence / self.temperature + h.log_prior + h.causes * more_of_a_cause
            + (more_of_unknown if h.name == "unknown" else 0.0)
            for h in hypotheses
        ])  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Judgement:
    """How probabilities do on cases that they were not learnt from."""

    cases: int
    of_the_truth: float
    """Mean probability given to it."""
    in_set_95: float
    """Share of cases in which the fewest hypotheses with 95 % of the probability hold it."""
    set_size: float
    """Median number of these."""
    calibration_error: float
    """Mean difference between the probability of the likeliest and the share in which it was true, over classes of
    probability, by their cases."""


@dataclass(frozen=True, kw_only=True)
class RuleCalibration:
    """The numbers in use and those learnt, judged on the same cases."""

    learnt_from: int
    """Number of cases."""
    in_use: RuleNumbers
    learnt: RuleNumbers
    in_use_judged: Judgement
    learnt_judged: Judgement
    model_error: tuple[float, float] | None
    """Median error of the steps' stiffness that clean rigs needed, and its spread as a factor; None without two."""


@dataclass(frozen=True)
class _Case:
    hypotheses: tuple[Weighed, ...]
    true: Array


def calibrate(results: Sequence[CaseResult]) -> RuleCalibration:
    """Learn from every other seed, and judge on those between.

    Raises
    ------
    ValueError
        If either part has too few cases: with one diagnosis each that came to its end, and nothing hidden but causes
        that models are fitted of.
    """
    learnt_seeds = set(sorted({result.plan.seed for result in results})[::2])
    from_these = [result for result in results if result.plan.seed in learnt_seeds]
    learn, others = _cases(from_these), _cases([r for r in results if r.plan.seed not in learnt_seeds])
    if min(len(learn), len(others)) < LIMITS.least_cases:
        found = f"{len(learn)} and {len(others)} cases"
        raise ValueError(f"{found} to learn from and to judge on, {LIMITS.least_cases} of each are needed")
    in_use, learnt = RuleNumbers(), _likeliest(learn)
    return RuleCalibration(
        learnt_from=len(learn),
        in_use=in_use,
        learnt=learnt,
        in_use_judged=_judged(others, in_use),
        learnt_judged=_judged(others, learnt),
        model_error=_model_error(from_these),
    )


def _cases(results: Sequence[CaseResult]) -> list[_Case]:
    found = []
    for result in results:
        hypotheses = tuple(Weighed(**each) for each in (result.found or {}).get("hypotheses", ()))
        if hypotheses and set(result.plan.causes) <= set(CAUSES):
            hidden = set(result.plan.causes) or {"none"}
            found.append(_Case(hypotheses, np.array([set(h.name.split(" + ")) == hidden for h in hypotheses])))
    return found


def _of_the_truth(case: _Case, numbers: RuleNumbers) -> float:
    return float(numbers.probabilities(case.hypotheses)[case.true].sum())


def _likeliest(cases: Sequence[_Case]) -> RuleNumbers:
    """The numbers at which the truth is most probable."""
    begin = np.array([np.log(DIAGNOSE.posterior_temperature), LOG_ODDS_OF_A_CAUSE, LOG_ODDS_OF_UNKNOWN])

    def numbers(x: Array) -> RuleNumbers:
        return RuleNumbers(
            temperature=float(np.exp(x[0])), log_odds_of_a_cause=float(x[1]), log_odds_of_unknown=float(x[2])
        )

    def cost(x: Array) -> float:
        score = sum(np.log(max(_of_the_truth(case, numbers(x)), LIMITS.least_probability)) for case in cases)
        return float(0.5 * np.sum(((x - begin) / LIMITS.calibration_wide) ** 2) - score)

    return numbers(minimize(cost, begin, method="Nelder-Mead", options={"xatol": 0.01, "fatol": 0.01}).x)


def _judged(cases: Sequence[_Case], numbers: RuleNumbers) -> Judgement:
    held, sizes, best, right = [], [], [], []
    for case in cases:
        p, names = numbers.probabilities(case.hypotheses), [h.name for h in case.hypotheses]
        true = {name for name, is_true in zip(names, case.true, strict=True) if is_true}
        chosen = smallest_set(names, p)
        held.append(bool(true & set(chosen)))
        sizes.append(len(chosen))
        first = chosen[0]
        best.append(sum(each for name, each in zip(names, p, strict=True) if name == first))
        right.append(first in true)
    return Judgement(
        cases=len(cases),
        of_the_truth=float(np.mean([_of_the_truth(case, numbers) for case in cases])),
        in_set_95=float(np.mean(held)),
        set_size=float(np.median(sizes)),
        calibration_error=calibration_error(np.array(best), np.array(right)),
    )


def calibration_error(probability: Array, right: Array) -> float:
    """Mean over classes of probability, by their cases, of what was said less what came true."""
    classes = np.minimum((probability * LIMITS.calibration_classes).astype(int), LIMITS.calibration_classes - 1)
    error = 0.0
    for number in np.unique(classes):
        own = classes == number
        error += np.mean(own) * abs(np.mean(probability[own]) - np.mean(right[own]))
    return float(error)


def _model_error(results: Sequence[CaseResult]) -> tuple[float, float] | None:
    errors = [
        r.found["model_error"]["inferred"] for r in results
        if not r.plan.causes and r.found and r.found["verdict"] == "none"
    ]  # fmt: skip
    if len(errors) < 2:
        return None
    return float(np.median(errors)), float(np.exp(np.std(np.log(errors), ddof=1)))
