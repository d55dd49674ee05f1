"""The score test: what each cause would gain, and how large it may be, at every place where it could sit.

From the residual r of a fit and its sensitivities J, whitened and with their prior as further rows, a cause whose
signature is x, with the unknowns and what sound rigs have of every cause projected out, has the size u / d^2 with the
standard deviation 1 / d, where
d^2 = x' x and u = x' r.  With a prior of unit size its log Bayes factor is u^2 / 2 (d^2 + 1) - ln(1 + d^2) / 2.  One
residual for each cause and place, no fit.
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
from twin.diagnose.model_evidence import Tolerances
from twin.diagnose.parallel_map import parallel_map
from twin.identify.base_fit import baseline_bounds
from twin.identify.gauss_newton import not_held_back
from twin.identify.measured_data import MeasuredData
from twin.identify.residual_model import Linearisation, ResidualModel
from twin.identify.whitening import HarmonicResiduals

__all__ = ["Score", "score_causes"]

Array = NDArray[Any]

SMALL = 1e-4
"""Strength, over the prior's scale, at which a signature is taken: resonances are sharp."""
FELT = 0.3
"""Least size of a direction of the tolerances, in standard deviations of the data."""


@dataclass(frozen=True)
class Score:
    """First order of one cause at one place.

    Attributes
    ----------
    hypothesis : CauseHypothesis
        With the strength that the first order suggests.
    size, std : float
        That strength less the one of no effect, as the data alone have it, and its standard deviation; in the
        parameter's unit.  Infinite where the data say nothing of it.
    log_bayes : float
        Expected gain of log evidence.
    """

    hypothesis: CauseHypothesis
    size: float
    std: float
    log_bayes: float


@dataclass(frozen=True)
class _Signature:
    """Change of the whitened residual with a cause's strength in units of its scale, at one place.

    Where the effect has no strength, what it leaves instead of the residual.
    """

    hypothesis: CauseHypothesis
    main: Parameter | None
    direction: float
    column: Array


def score_causes(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, causes: Mapping[str, Cause]
) -> tuple[list[Score], Tolerances]:
    """Score every cause, label and starting place against the residual of `model`, best first.

    Returns
    -------
    list of Score
    Tolerances
        What a sound rig may have of every cause, and what is no sign of any therefore.
    """
    modification = modification_of(evidence, model.hypotheses)
    # Differences over small strengths are taken with what the model holds: weights, and what its harmonics add.
    held = ResidualModel(evidence, modification, harmonics, errors=model.errors).linearisation(model.baseline)
    # The priors are sound rigs': a cause gains by explaining what a loose fit put down to natural frequencies.
    residual_model = ResidualModel(evidence, modification, harmonics, held=held)
    prediction = residual_model.evaluate(model.baseline)
    common = (evidence, harmonics, model, held, prediction.residual)
    found = parallel_map(_signatures_of, common, [(cause,) for cause in causes.values()])
    signatures = [signature for each in found for signature in each]
    tolerated = [s.column * s.main.tolerance for s in signatures if s.main is not None]
    columns = _principal(np.column_stack(tolerated)) if tolerated else np.zeros((len(prediction.residual), 0))
    mean, precision = residual_model.prior(model.baseline)
    # The priors as further rows: a cause may gain by taking over what the unknowns strain to explain.
    root = np.linalg.cholesky(precision).T
    r = np.concatenate([prediction.residual, root @ (mean - model.baseline.vector), np.zeros(columns.shape[1])])
    J = np.block([[prediction.jacobian, columns], [root, np.zeros((len(root), columns.shape[1]))]])
    J = np.vstack([J, np.eye(J.shape[1])[len(root) :]])
    # An unknown at its limit, which the residual pushes outwards, cannot take over anything.
    lower, upper = (baseline_bounds(model.baseline, side) for side in (0, 1))
    pull = J[:, : len(root)].T @ r
    free = np.append(not_held_back(model.baseline.vector, pull, lower, upper), np.ones(columns.shape[1], bool))
    outside = _Outside(J[:, free], cho_factor(J[:, free].T @ J[:, free]))
    scores = [_score(signature, r, len(prediction.residual), outside) for signature in signatures]
    return sorted(scores, key=lambda score: -score.log_bayes), Tolerances.of(columns, prediction.blocks, held)


def _principal(columns: Array) -> Array:
    """The fewest columns that have the same covariance, but for what no data of this length could tell."""
    U, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(U[:, size > FELT] * size[size > FELT])


@dataclass(frozen=True)
class _Outside:
    """Projects a signature on what the unknowns cannot imitate."""

    J: Array
    factor: tuple[Array, bool]

    def __call__(self, column: Array) -> Array:
        return np.asarray(column - self.J @ cho_solve(self.factor, self.J.T @ column))


def _signatures_of(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    held: Linearisation,
    residual: Array,
    cause: Cause,
) -> list[_Signature]:
    """Signatures of every label and starting place of one cause."""
    found = []
    for label in cause.labels(evidence):
        parameters = cause.parameters(evidence, label)
        main = main_strength(parameters)
        for start in _starts(parameters):
            values, strength = _at_small_strength(parameters, start)
            hypothesis = CauseHypothesis(cause, label, values, {})
            modification = modification_of(evidence, (*model.hypotheses, hypothesis))
            changed = ResidualModel(evidence, modification, harmonics, held=held)
            after = changed.evaluate(model.baseline, sensitivities=False).residual
            if not np.isfinite(after).all():
                continue
            column = after if main is None else (residual - after) * main.scale / strength
            found.append(_Signature(hypothesis, main, strength, column))
    return found


def _score(signature: _Signature, r: Array, data: int, outside: _Outside) -> Score:
    hypothesis, main = signature.hypothesis, signature.main
    if main is None:
        return Score(hypothesis, 0.0, np.inf, 0.5 * float(r[:data] @ r[:data] - signature.column @ signature.column))
    column = outside(np.concatenate([signature.column, np.zeros(len(r) - data)]))
    d2, u = float(column @ column), float(column @ r)
    # Bounds matter: a mass that would have to be negative explains nothing.
    lower, upper = (main.lower - main.null) / main.scale, (main.upper - main.null) / main.scale
    amount = float(np.clip(u / (d2 + 1.0), lower, upper))
    log_bayes = amount * u - 0.5 * amount**2 * (d2 + 1.0) - 0.5 * np.log1p(d2)
    # First order is trusted within the prior's scale, and a start at nothing at all would have no slope to follow.
    size = np.copysign(np.clip(abs(amount), 1e-3, 1.0), amount or signature.direction) * main.scale
    values = {**hypothesis.values, main.name: float(np.clip(main.null + size, main.lower, main.upper))}
    return Score(
        CauseHypothesis(hypothesis.cause, hypothesis.label, values, {}),
        u / d2 * main.scale if d2 > 0 else 0.0,
        main.scale / np.sqrt(d2) if d2 > 0 else np.inf,
        float(log_bayes),
    )


def _starts(parameters: tuple[Parameter, ...]) -> Iterator[dict[str, float]]:
    """Every combination of starting values; further strengths keep their first."""
    main = main_strength(parameters)
    names = [p.name for p in parameters]
    lists = [p.starts if p.is_location else (p.starts if p is main else p.starts[:1]) for p in parameters]
    for combination in product(*lists):
        yield dict(zip(names, combination, strict=True))


def _at_small_strength(parameters: tuple[Parameter, ...], start: dict[str, float]) -> tuple[dict[str, float], float]:
    """Values at a strength small enough for first order, on the side of the start, and the strength's distance."""
    main = main_strength(parameters)
    if main is None:
        return start, 1.0
    step = np.copysign(min(abs(start[main.name] - main.null), SMALL * main.scale), start[main.name] - main.null)
    return {**start, main.name: main.null + float(step)}, float(step)
