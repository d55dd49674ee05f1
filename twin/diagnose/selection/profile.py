"""Profile likelihood of a threshold: in it the likelihood has many maxima, and a fit ends in the one it begins in.

The threshold is held at one value after the other while all else is fitted, each fit begun from its neighbour's end
(continuation), so that a value costs two or three Gauss-Newton steps.
"""

from collections.abc import Iterator
from dataclasses import replace
from itertools import islice

from twin.diagnose.cause import Parameter
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up


def threshold_of(evidence: MeasuredData, fit: FittedModel) -> Parameter | None:
    """The threshold of the model's last cause, if it has one."""
    if not fit.hypotheses:
        return None
    last = fit.hypotheses[-1]
    return next((p for p in last.cause.parameters(evidence, last.label) if p.is_threshold and p.starts), None)


def highest_of_profile(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    fit: FittedModel,
    threshold: Parameter,
    tolerances: ResidualColumns,
) -> FittedModel:
    """The fit with the likeliest value of a threshold of its last cause, all else fitted at the model error of `fit`.

    Values are tried over the range in which the cause's fits begin.
    """
    for halvings in range(1 + LIMITS.profile_halvings):
        ratio, most = LIMITS.profile_apart**0.5**halvings, 1 if halvings else None
        work = [(fit, threshold, factor, most, tolerances) for factor in (ratio, 1 / ratio)]
        fit = min((fit, *parallel_map(_along, (evidence, harmonics), work)), key=lambda found: found.solution.cost)
    return fit


def _along(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    fit: FittedModel,
    threshold: Parameter,
    factor: float,
    most: int | None,
    tolerances: ResidualColumns,
) -> FittedModel:
    """The best fit of those in one direction, up to so many; it is left where two in a row lead nowhere."""
    best = last = fit
    failed = 0
    for value in islice(_values(threshold, fit.hypotheses[-1].values[threshold.name], factor), most):
        if time_is_up() or failed == 2:
            break
        *before, own = last.hypotheses
        own = replace(own, values={**own.values, threshold.name: value})
        found = fit_model(
            evidence, harmonics, last.baseline, (*before, own), errors=fit.errors, tolerances=tolerances,
            options=FitOptions(tolerance=0.5, rounds=0, held=(len(before), threshold.name)),
        )  # fmt: skip
        best = min(best, found, key=lambda each: each.solution.cost)
        failed = failed + 1 if found.solution.cost > LIMITS.profile_hopeless * best.solution.cost else 0
        last = last if failed else found
    return best


def _values(threshold: Parameter, start: float, factor: float) -> Iterator[float]:
    """Values away from the start, within the range of the beginnings and half a step of these."""
    lower, upper = (
        min(threshold.starts) / LIMITS.cause_ratio,
        min(max(threshold.starts) * LIMITS.cause_ratio, threshold.upper),
    )
    value = min(max(start, lower), upper)
    while lower <= value * factor <= upper:
        value *= factor
        yield value
