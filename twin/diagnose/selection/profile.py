"""Profile likelihood of a threshold: in it the likelihood has many maxima, and a fit ends in the one it begins in.

The threshold is held at one value after the other while all else is fitted, each fit begun from its neighbour's end.
That is done first with a model error so large that maxima are wide, over all values from which an effect may begin;
with smaller errors, finer and about the best so far.  Free it is last of all.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from twin.diagnose.cause import Parameter
from twin.diagnose.fit_problem import CauseHypothesis
from twin.diagnose.fitted_model import FitOptions, FittedModel, fit_model
from twin.diagnose.limits import LIMITS
from twin.diagnose.residual_columns import ResidualColumns
from twin.identify.measured_data import MeasuredData
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up

COARSE = FitOptions(iterations=15, tolerance=2.0, rounds=0)
"""Of fits on the way."""


@dataclass(frozen=True)
class Profile:
    """Of the threshold of a model's last cause, beside what sound rigs have of every cause."""

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None
    tolerances: ResidualColumns
    threshold: Parameter
    held: tuple[int, str]
    """The cause's number and the threshold's name."""

    @classmethod
    def of(
        cls,
        evidence: MeasuredData,
        harmonics: HarmonicResiduals | None,
        tolerances: ResidualColumns,
        hypotheses: tuple[CauseHypothesis, ...],
    ) -> Profile | None:
        """None where the last cause has no threshold."""
        threshold = threshold_of(evidence, hypotheses[-1])
        if threshold is None:
            return None
        return cls(evidence, harmonics, tolerances, threshold, (len(hypotheses) - 1, threshold.name))

    def highest(self, fit: FittedModel, *, halvings: int) -> FittedModel:
        """The fit with the likeliest value, all else fitted at the model error of `fit`.

        Parameters
        ----------
        halvings
            How often the distance of values is halved, in logarithms: without, all over the range are tried; else the
            neighbours of the one that `fit` has.
        """
        ratio = LIMITS.cause_ratio**0.5**halvings
        for factor in (ratio, 1 / ratio):  # the second from the best of the first
            fit = min((fit, *self._along(fit, factor, halvings)), key=lambda each: each.solution.cost)
        return fit

    def _along(self, fit: FittedModel, factor: float, halvings: int) -> Iterator[FittedModel]:
        """Fits in one direction, which ends where two in a row lead nowhere."""
        last, least, failed = fit, fit.solution.cost, 0
        for value in self._values(fit.hypotheses[-1].values[self.threshold.name], factor):
            if time_is_up() or failed == 2:
                return
            *before, own = last.hypotheses
            own = replace(own, values={**own.values, self.threshold.name: value})
            found = fit_model(
                self.evidence, self.harmonics, last.baseline, (*before, own), errors=fit.errors,
                tolerances=self.tolerances, options=replace(COARSE, held=self.held),
            )  # fmt: skip
            yield found
            if halvings:
                return
            least = min(least, found.solution.cost)
            failed = failed + 1 if found.solution.cost > LIMITS.profile_hopeless * least else 0
            last = last if failed else found

    def _values(self, start: float, factor: float) -> Iterator[float]:
        """Values away from the start, within the range of the beginnings and half a step of these."""
        starts = self.threshold.starts
        lower, upper = min(starts) / LIMITS.cause_ratio, min(max(starts) * LIMITS.cause_ratio, self.threshold.upper)
        value = min(max(start, lower), upper)
        while lower <= value * factor <= upper:
            value *= factor
            yield value


def threshold_of(evidence: MeasuredData, hypothesis: CauseHypothesis) -> Parameter | None:
    """The threshold of a cause, if it has one and something says where that may be."""
    parameters = hypothesis.cause.parameters(evidence, hypothesis.label)
    return next((p for p in parameters if p.is_threshold and p.starts), None)
