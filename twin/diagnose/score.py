"""The score test: how much each cause would gain, to first order, at every place where it could sit.

With the residual r and the sensitivities J of the unknowns, whitened and with their prior, a cause whose column is c
gains (c' M r)^2 / (c' M c + 1 / scale^2), M = 1 - J (J'J + P)^-1 J'.  One product for each cause, no refit.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import cho_factor, cho_solve

from twin.diagnose.cause import Cause, Parameter, main_strength
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, modification_of
from twin.diagnose.parallel_map import parallel_map
from twin.identify.base_fit import baseline_bounds
from twin.identify.baseline_parameters import TIGHT, DiscrepancyLevel
from twin.identify.gauss_newton import not_held_back
from twin.identify.measured_data import MeasuredData
from twin.identify.residual_model import Linearisation, ResidualModel
from twin.identify.whitening import HarmonicResiduals

__all__ = ["Score", "score_causes"]

Array = NDArray[Any]

SMALL = 1e-4
"""Strength, over the prior's scale, at which a signature is taken: resonances are sharp."""


@dataclass(frozen=True)
class Score:
    """First-order gain of one cause at one place.

    Attributes
    ----------
    name : CauseHypothesis
        With the strength that the first order suggests.
    gain : float
        Expected fall of chi2.
    column : ndarray
        The cause's whitened signature with the unknowns projected out, of unit length.
    """

    hypothesis: CauseHypothesis
    gain: float
    column: Array


def score_causes(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    causes: Mapping[str, Cause],
    *,
    discrepancy: DiscrepancyLevel = TIGHT,
) -> list[Score]:
    """Score every cause, label and starting place against the residual of `model`, best first."""
    modification = modification_of(evidence, model.hypotheses)
    # Differences over small strengths are taken with what the model holds: weights, and what its harmonics add.
    held = ResidualModel(evidence, modification, harmonics, discrepancy=discrepancy).linearisation(model.baseline)
    residual_model = ResidualModel(evidence, modification, harmonics, discrepancy=discrepancy, held=held)
    prediction = residual_model.evaluate(model.baseline)
    mean, precision = residual_model.prior(model.baseline)
    # The prior as further rows: a cause may gain by taking over what the unknowns strain to explain.
    root = np.linalg.cholesky(precision).T
    r = np.concatenate([prediction.residual, root @ (mean - model.baseline.vector)])
    J = np.vstack([prediction.jacobian, root])
    # An unknown at its limit, which the residual pushes outwards, cannot take over anything.
    lower, upper = (baseline_bounds(model.baseline, side) for side in (0, 1))
    J = J[:, not_held_back(model.baseline.vector, J.T @ r, lower, upper)]
    outside = _Outside(J, cho_factor(J.T @ J))
    common = (evidence, harmonics, model, discrepancy, held, r, outside)
    scores = parallel_map(_scores_of, common, [(cause,) for cause in causes.values()])
    return sorted((score for each in scores for score in each), key=lambda score: -score.gain)


@dataclass(frozen=True)
class _Outside:
    """Projects a signature on what the unknowns cannot imitate."""

    J: Array
    factor: tuple[Array, bool]

    def __call__(self, column: Array) -> Array:
        return np.asarray(column - self.J @ cho_solve(self.factor, self.J.T @ column))


def _scores_of(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    discrepancy: DiscrepancyLevel,
    held: Linearisation | None,
    r: Array,
    outside: _Outside,
    cause: Cause,
) -> list[Score]:
    """Scores of every label and starting place of one cause, with the residual r and the prior's rows behind it."""
    scores = []
    for label in cause.labels(evidence):
        parameters = cause.parameters(evidence, label)
        for start in _starts(parameters):
            values, strength = _at_small_strength(parameters, start)
            hypothesis = CauseHypothesis(cause, label, values, {})
            modification = modification_of(evidence, (*model.hypotheses, hypothesis))
            extended = ResidualModel(evidence, modification, harmonics, discrepancy=discrepancy, held=held)
            changed = extended.evaluate(model.baseline, sensitivities=False).residual
            changed = np.concatenate([changed, r[len(changed) :]])
            scores.append(_score(hypothesis, parameters, strength, r, changed, outside))
    return scores


def _score(
    hypothesis: CauseHypothesis,
    parameters: tuple[Parameter, ...],
    strength: float,
    r: Array,
    changed: Array,
    outside: _Outside,
) -> Score:
    if not np.isfinite(changed).all():
        return Score(hypothesis, 0.0, np.zeros(len(r)))
    main = main_strength(parameters)
    if main is None:
        return Score(hypothesis, float(r @ r - changed @ changed), np.zeros(len(r)))
    column = outside((r - changed) * main.scale / strength)
    length2 = float(column @ column)
    amount = float(column @ r) / (length2 + 1.0)
    estimate = float(np.clip(main.null + amount * main.scale, main.lower, main.upper))
    # Bounds matter: a mass that would have to be negative explains nothing.
    amount = (estimate - main.null) / main.scale
    gain = 2 * amount * float(column @ r) - amount**2 * (length2 + 1.0)
    # First order is trusted within the prior's scale, and a start at nothing at all would have no slope to follow.
    least = main.null + np.copysign(1e-3 * main.scale, estimate - main.null or strength)
    value = least if abs(estimate - main.null) < abs(least - main.null) else estimate
    value = float(np.clip(value, main.null - main.scale, main.null + main.scale))
    values = {**hypothesis.values, main.name: float(np.clip(value, main.lower, main.upper))}
    return Score(
        CauseHypothesis(hypothesis.cause, hypothesis.label, values, {}), gain, column / np.sqrt(length2 + 1e-300)
    )


def _starts(parameters: tuple[Parameter, ...]) -> Iterator[dict[str, float]]:
    """Every combination of starting values; further strengths keep their first."""
    main = main_strength(parameters)
    names = [p.name for p in parameters]
    lists = [p.starts if p.places else (p.starts if p is main else p.starts[:1]) for p in parameters]
    for combination in product(*lists):
        yield dict(zip(names, combination, strict=True))


def _at_small_strength(parameters: tuple[Parameter, ...], start: dict[str, float]) -> tuple[dict[str, float], float]:
    """Values at a strength small enough for first order, on the side of the start, and the strength's distance."""
    main = main_strength(parameters)
    if main is None:
        return start, 1.0
    step = np.copysign(min(abs(start[main.name] - main.null), SMALL * main.scale), start[main.name] - main.null)
    return {**start, main.name: main.null + float(step)}, float(step)
