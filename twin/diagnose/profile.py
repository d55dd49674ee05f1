"""The profile of a model over the parameter that says where, or from which amplitude on, its last cause acts.

Such a parameter has many false minima, and valleys that a joint fit creeps along: at fixed values all others are found
quickly, each beginning from its neighbour's.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.candidate import Blame, Candidate, fit_candidate
from twin.diagnose.cause import Parameter
from twin.identify.evidence import Evidence
from twin.identify.unknowns import STIFF, Unknowns
from twin.identify.whitening import HarmonicResiduals

__all__ = ["along_profile", "refined"]

Begin = Callable[[Unknowns, tuple[Blame, ...]], Unknowns]

POINTS, VALLEYS = 20, 3
FAR, FEW = 2.0, 3
CLOSE = 20.0
"""Log evidence that a further look at all data may still make up."""
RATIOS, MOVES = (1.07, 1.025), 4
"""Steps of a threshold, coarse ones first, and most of each size."""
WIDE = 8.0
"""Largest over smallest start from which a profile is spaced by ratios."""


def along_profile(
    evidence: Evidence, harmonics: HarmonicResiduals | None, candidate: Candidate, *, begin: Begin
) -> list[Candidate]:
    """The candidate and what else its profile leads to, as far as this evidence hardly tells them apart.

    Linear causes need no profile.

    Parameters
    ----------
    begin
        Gives the unknowns to begin from beside the causes at their values.
    """
    blame = candidate.blames[-1]
    if not blame.cause.extension(evidence, blame.label, blame.values).nonlinear:
        return [candidate]
    placing = [p for p in blame.cause.parameters(evidence, blame.label) if p.places and len(p.starts) > 1]
    found = [candidate]
    for parameter in placing:
        unknowns, blames = candidate.unknowns, candidate.blames
        fits = []
        for value in _grid(parameter):
            blames = _with_value(blames, parameter.name, float(value))
            unknowns = begin(unknowns, blames)
            fit = fit_candidate(
                evidence, harmonics, unknowns, blames, iterations=10, tolerance=1.0, held=parameter.name, slack=STIFF
            )
            fits.append(fit)
            if _hopeless(fits):
                break
            unknowns, blames = fit.unknowns, fit.blames
        for fit in _least(fits):
            found.append(
                fit_candidate(evidence, harmonics, fit.unknowns, fit.blames, iterations=12, tolerance=1.0, slack=STIFF)
            )
    best = max(fit.log_evidence for fit in found)
    return [fit for fit in found if fit.log_evidence > best - CLOSE]


def refined(
    evidence: Evidence, harmonics: HarmonicResiduals | None, candidate: Candidate, *, begin: Begin
) -> Candidate:
    """The candidate with the thresholds of its last cause moved downhill, all else refitted at each of their values."""
    blame = candidate.blames[-1]
    if not blame.cause.extension(evidence, blame.label, blame.values).nonlinear:
        return candidate
    best = candidate
    for parameter in blame.cause.parameters(evidence, blame.label):
        if not parameter.places or not _by_ratios(parameter):
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


def _hopeless(fits: list[Candidate]) -> bool:
    """Whether the last few values are all far worse than the best: beyond a threshold's valley there is no other."""
    least = min(fit.solution.cost for fit in fits)
    return all(fit.solution.cost > FAR * least for fit in fits[-FEW:]) if len(fits) >= FEW else False


def _least(fits: list[Candidate]) -> list[Candidate]:
    """Local minima along a profile, the best first, no more than :data:`VALLEYS`."""
    cost = [np.inf, *(fit.solution.cost for fit in fits), np.inf]
    valleys = [fit for k, fit in enumerate(fits) if cost[k] > cost[k + 1] <= cost[k + 2]]
    return sorted(valleys, key=lambda fit: fit.solution.cost)[:VALLEYS]


def _grid(parameter: Parameter) -> NDArray[Any]:
    """Values over the span of the parameter's starts and a little beyond, falling."""
    low, high = min(parameter.starts), max(parameter.starts)
    if _by_ratios(parameter):
        return np.geomspace(min(2 * high, parameter.upper), low, POINTS)
    return np.linspace(high, low, POINTS)
