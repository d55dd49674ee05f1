"""Thresholds of a model's last cause, or the frequency it is tuned to, moved downhill.

From which amplitude on an effect acts, or at which frequency, has valleys that a joint fit creeps along: at fixed
values all else is found quickly, each time beginning from its neighbour's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from twin.diagnose.candidate import Blame, Candidate, fit_candidate
from twin.diagnose.cause import Parameter
from twin.identify.evidence import Evidence
from twin.identify.unknowns import Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = ["refined"]

Begin = Callable[[Unknowns, tuple[Blame, ...]], Unknowns]

RATIOS, MOVES = (1.07, 1.025), 4
"""Steps of a threshold, coarse ones first, and most of each size."""
WIDE = 8.0
"""Largest over smallest start from which a parameter is a threshold rather than a place."""


def refined(
    evidence: Evidence, harmonics: HarmonicResiduals | None, candidate: Candidate, *, begin: Begin
) -> Candidate:
    """The candidate with the thresholds of its last cause moved downhill, all else refitted at each of their values.

    Parameters
    ----------
    begin
        Gives the unknowns to begin from beside the causes at their values.
    """
    blame = candidate.blames[-1]
    nonlinear = blame.nonlinear(evidence)
    best = candidate
    for parameter in blame.cause.parameters(evidence, blame.label):
        tuned = parameter.name == "frequency_Hz"
        if not (parameter.places and (tuned or (nonlinear and _by_ratios(parameter)))):
            continue
        for ratio in RATIOS:
            for factor in (ratio, 1 / ratio):
                for _ in range(MOVES):
                    value = best.blames[-1].values[parameter.name] * factor
                    value = float(np.clip(value, parameter.lower, parameter.upper))
                    blames = _with_value(best.blames, parameter.name, value)
                    start = begin(best.unknowns, blames)
                    trial = fit_candidate(
                        evidence, harmonics, start, blames, iterations=10, tolerance=0.3, held=parameter.name
                    )
                    if trial.solution.cost >= best.solution.cost:
                        break
                    best = trial
    if best is candidate:
        return candidate
    freed = fit_candidate(evidence, harmonics, best.unknowns, best.blames, tolerance=0.3)
    return freed if freed.log_evidence > candidate.log_evidence else candidate


def _with_value(blames: tuple[Blame, ...], name: str, value: float) -> tuple[Blame, ...]:
    """The causes with another value of one parameter of the last."""
    last = blames[-1]
    return (*blames[:-1], replace(last, values={**last.values, name: value}))


def _by_ratios(parameter: Parameter) -> bool:
    """Whether the starts span so much that the parameter is a threshold rather than a place."""
    return len(parameter.starts) > 1 and max(parameter.starts) > WIDE * min(parameter.starts) > 0
