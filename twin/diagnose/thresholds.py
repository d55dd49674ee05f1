"""Thresholds of a model's last cause, or the frequency it is tuned to, moved downhill.

From which amplitude on an effect acts, or at which frequency, has valleys that a joint fit creeps along: at fixed
values all else is found quickly, each time beginning from its neighbour's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.diagnose.cause import Parameter
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, fit_model
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.whitening import HarmonicResiduals

__all__ = ["refined"]

Begin = Callable[[BaselineParameters, tuple[CauseHypothesis, ...]], BaselineParameters]

RATIOS, MOVES = (1.07, 1.025), 4
"""Steps of a threshold, coarse ones first, and most of each size."""
WIDE = 8.0
"""Largest over smallest start from which a parameter is a threshold rather than a place."""


def refined(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, fitted_model: FittedModel, *, begin: Begin
) -> FittedModel:
    """The candidate with the thresholds of its last cause moved downhill, all else refitted at each of their values.

    Parameters
    ----------
    begin
        Gives the unknowns to begin from beside the causes at their values.
    """
    hypothesis = fitted_model.hypotheses[-1]
    nonlinear = hypothesis.nonlinear(evidence)
    best = fitted_model
    for parameter in hypothesis.cause.parameters(evidence, hypothesis.label):
        tuned = parameter.name == "frequency_Hz"
        if not (parameter.places and (tuned or (nonlinear and _by_ratios(parameter)))):
            continue
        for ratio in RATIOS:
            for factor in (ratio, 1 / ratio):
                for _ in range(MOVES):
                    value = best.hypotheses[-1].values[parameter.name] * factor
                    value = float(np.clip(value, parameter.lower, parameter.upper))
                    hypotheses = _with_value(best.hypotheses, parameter.name, value)
                    start = begin(best.baseline, hypotheses)
                    trial = fit_model(
                        evidence, harmonics, start, hypotheses, iterations=10, tolerance=0.3, held=parameter.name
                    )
                    if trial.solution.cost >= best.solution.cost:
                        break
                    best = trial
    if best is fitted_model:
        return fitted_model
    freed = fit_model(evidence, harmonics, best.baseline, best.hypotheses, tolerance=0.3)
    return freed if freed.log_evidence > fitted_model.log_evidence else fitted_model


def _with_value(hypotheses: tuple[CauseHypothesis, ...], name: str, value: float) -> tuple[CauseHypothesis, ...]:
    """The causes with another value of one parameter of the last."""
    last = hypotheses[-1]
    return (*hypotheses[:-1], replace(last, values={**last.values, name: value}))


def _by_ratios(parameter: Parameter) -> bool:
    """Whether the starts span so much that the parameter is a threshold rather than a place."""
    return len(parameter.starts) > 1 and max(parameter.starts) > WIDE * min(parameter.starts) > 0
