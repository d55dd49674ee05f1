"""Profile likelihood of a threshold: in it the likelihood has many maxima, and a fit ends in the one it begins in.

The threshold is held at one value after the other while all else is fitted, each fit begun from its neighbour's end.
That is done first with a model error so large that maxima are wide, over all values from which an effect may begin;
with smaller errors, finer and about the best so far.  Free it is last of all.
"""

from collections.abc import Callable, Iterator
from dataclasses import replace

from twin.diagnose.cause import Parameter
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.time_limit import time_is_up

Fit = Callable[[BaselineParameters, tuple[CauseHypothesis, ...]], FittedModel]
"""Fits a model from where it begins, with the threshold held there."""


def highest(begun: FittedModel, threshold: Parameter, fit: Fit, *, halvings: int) -> FittedModel:
    """The fit with the likeliest value of the threshold of the last cause, one of those that begin at `begun`.

    Parameters
    ----------
    fit
        At the model error of `begun`.
    halvings
        How often the distance of values is halved, in logarithms: without, all over the range are tried; else the
        neighbours of the one that `begun` has.
    """
    ratio = LIMITS.cause_ratio**0.5**halvings
    for factor in (ratio, 1 / ratio):  # the second from the best of the first
        begun = min((begun, *_along(begun, threshold, fit, factor, halvings)), key=lambda each: each.solution.cost)
    return begun


def _along(begun: FittedModel, threshold: Parameter, fit: Fit, factor: float, halvings: int) -> Iterator[FittedModel]:
    """Fits in one direction, which ends where two in a row lead nowhere."""
    last, least, failed = begun, begun.solution.cost, 0
    for value in _values(threshold, begun.hypotheses[-1].values[threshold.name], factor):
        if time_is_up() or failed == 2:
            return
        *before, own = last.hypotheses
        found = fit(last.baseline, (*before, replace(own, values={**own.values, threshold.name: value})))
        yield found
        if halvings:
            return
        least = min(least, found.solution.cost)
        failed = failed + 1 if found.solution.cost > LIMITS.profile_hopeless * least else 0
        last = last if failed else found


def _values(threshold: Parameter, start: float, factor: float) -> Iterator[float]:
    """Values away from the start, within the range of the beginnings and half a step of these."""
    starts = threshold.starts
    lower, upper = min(starts) / LIMITS.cause_ratio, min(max(starts) * LIMITS.cause_ratio, threshold.upper)
    value = min(max(start, lower), upper)
    while lower <= value * factor <= upper:
        value *= factor
        yield value


def threshold_of(evidence: MeasuredData, hypothesis: CauseHypothesis) -> Parameter | None:
    """The threshold of a cause, if it has one and something says where that may be."""
    parameters = hypothesis.cause.parameters(evidence, hypothesis.label)
    return next((p for p in parameters if p.is_threshold and p.starts), None)
