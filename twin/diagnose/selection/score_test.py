"""The score test: what each cause would gain, and how large it may be, at every place where it could sit.

From the residual r of a fit and its sensitivities J, whitened and with their prior as further rows, a cause whose
signatures by its strengths are the columns X, with the unknowns and what sound rigs have of every cause projected out,
has the sizes D^-1 u with the covariance D^-1, where D = X' X and u = X' r.  With priors of unit size its log Bayes
factor is u' (D + 1)^-1 u / 2 - ln det(1 + D) / 2.  One residual for each strength and place, no fit.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.linalg import cho_factor, cho_solve

from twin.arrays import Array
from twin.diagnose.cause import Cause, Parameter, strengths_of
from twin.diagnose.fitted_model import CauseHypothesis, FittedModel, difference_step, modification_of
from twin.diagnose.limits import LIMITS
from twin.diagnose.model_evidence import Tolerances
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.selection.attachment_signatures import AttachmentSignatures
from twin.identify.base_fit import baseline_bounds
from twin.identify.gauss_newton import not_held_back
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.likelihood import residual_model, solves_modes
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.prediction import Prediction
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up

__all__ = ["Score", "score_causes"]

SMALL = 1e-3
"""Share of a tolerance over which its difference is taken."""


@dataclass(frozen=True)
class Score:
    """First order of one cause at one place.

    Attributes
    ----------
    hypothesis : CauseHypothesis
        With the strength that the first order suggests.
    size, std : float
        Its first strength less the one of no effect, as the data alone have it, and its standard deviation; in the
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
    """Change (r, k) of the whitened residual with a cause's strengths in units of their scales, at one place.

    Where the effect has no strength, what it leaves instead of the residual.  There are so many thresholds to each
    place.
    """

    hypothesis: CauseHypothesis
    strengths: tuple[Parameter, ...]
    columns: Array
    thresholds: int

    @property
    def tolerated(self) -> Array:
        """What a sound rig may have of it: shared out among the thresholds, of which it has one."""
        return np.asarray(self.columns * [p.tolerance / np.sqrt(self.thresholds) for p in self.strengths])


def score_causes(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, causes: Mapping[str, Cause]
) -> tuple[list[Score], Tolerances]:
    """Score every cause, label and starting place against the residual of `model`, best first, while there is time.

    Returns
    -------
    list of Score
    Tolerances
        What a sound rig may have of every cause, and what is no sign of any therefore.
    """
    modification = modification_of(evidence, model.hypotheses)
    # Differences over small strengths are taken with what the model holds: weights, and what its harmonics add.
    held = residual_model(evidence, modification, harmonics, errors=model.errors).linearisation(model.baseline)
    # The priors are sound rigs': a cause gains by explaining what a loose fit put down to natural frequencies.
    sound = residual_model(evidence, modification, harmonics, held=held)
    prediction = sound.evaluate(model.baseline)
    common = (evidence, harmonics, model, held, prediction)
    found = parallel_map(_signatures_of, common, [(cause,) for cause in causes.values()])
    signatures = [signature for each in found for signature in each]
    tolerated = [signature.tolerated for signature in signatures if signature.strengths]
    tolerated += _of_openings(evidence, harmonics, model, held, prediction)
    columns = _principal(np.column_stack(tolerated)) if tolerated else np.zeros((len(prediction.residual), 0))
    tolerances = Tolerances.of(columns, prediction.blocks, held)
    columns = tolerances.whitened(prediction.blocks, held)
    mean, precision = sound.prior(model.baseline)
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
    return sorted(scores, key=lambda score: -score.log_bayes), tolerances


def _of_openings(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    held: Linearisation,
    prediction: Prediction,
) -> list[Array]:
    """Columns (r, 1) of another opening in place of the mean of each joint's layer elements, by which its law goes.

    One mode's law takes that in, and with it two modes' laws differ.
    """
    left_by, found = _left_by(evidence, harmonics, model, held), []
    for joint, law in zip(evidence.rig.joints, model.baseline.laws, strict=False):
        if np.any(law.softening):
            little = ModelModification(towards_middle={joint.name: LIMITS.score_test_towards_middle * SMALL})
            found.append((prediction.residual - left_by(little))[:, None] / SMALL)
    return found


def _left_by(
    evidence: MeasuredData, harmonics: HarmonicResiduals | None, model: FittedModel, held: Linearisation
) -> Callable[[ModelModification], Array]:
    """What a modification of a fitted model leaves as its whitened residual (r,)."""
    without = modification_of(evidence, model.hypotheses)

    def left_by(modification: ModelModification) -> Array:
        changed = residual_model(evidence, without.merged(modification), harmonics, held=held)
        return changed.evaluate(model.baseline, sensitivities=False).residual

    return left_by


def _principal(columns: Array) -> Array:
    """The fewest columns that have the same covariance, but for what no data of this length could tell."""
    U, size, _ = np.linalg.svd(columns, full_matrices=False)
    return np.asarray(U[:, size > LIMITS.score_test_felt] * size[size > LIMITS.score_test_felt])


@dataclass(frozen=True)
class _Outside:
    """Projects signatures on what the unknowns cannot imitate."""

    J: Array
    factor: tuple[Array, bool]

    def __call__(self, columns: Array) -> Array:
        return np.asarray(columns - self.J @ cho_solve(self.factor, self.J.T @ columns))


def _signatures_of(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    held: Linearisation,
    prediction: Prediction,
    cause: Cause,
) -> list[_Signature]:
    """Signatures of every label and starting place of one cause."""
    left_by = _left_by(evidence, harmonics, model, held)
    plain = residual_model(evidence, modification_of(evidence, model.hypotheses), harmonics, held=held)
    small = AttachmentSignatures(plain, prediction, left_by) if isinstance(plain, ResidualModel) else None
    found: list[_Signature] = []
    for label in cause.labels(evidence):
        if time_is_up():
            break
        parameters = cause.parameters(evidence, label)
        strengths = strengths_of(parameters)
        count = int(np.prod([len(p.starts) for p in parameters if p.is_threshold]))
        for start in _starts(parameters):
            if not strengths:
                columns = left_by(cause.modification(evidence, label, start))[:, None]
            else:
                # A structure made anew differs a little from the assumed one, without any effect in it.
                remakes = solves_modes(evidence, cause.modification(evidence, label, start))
                none = {**start, **{p.name: p.null for p in strengths}}
                before = left_by(cause.modification(evidence, label, none)) if remakes else prediction.residual
                columns = np.empty((len(prediction.residual), len(strengths)))
                for k, p in enumerate(strengths):
                    step = _small_step(p, start[p.name] - p.null, remakes=remakes)
                    little = cause.modification(evidence, label, {**none, p.name: p.null + step})
                    change = before - left_by(little) if remakes or small is None else small.change_by(little)
                    columns[:, k] = change * p.scale / step
            if np.isfinite(columns).all():
                found.append(_Signature(CauseHypothesis(cause, label, start, {}), strengths, columns, count))
    return found


def _score(signature: _Signature, r: Array, data: int, outside: _Outside) -> Score:
    hypothesis, strengths = signature.hypothesis, signature.strengths
    if not strengths:
        left = signature.columns[:, 0]
        return Score(hypothesis, 0.0, np.inf, 0.5 * float(r[:data] @ r[:data] - left @ left))
    X = outside(np.vstack([signature.columns, np.zeros((len(r) - data, len(strengths)))]))
    D, u = X.T @ X, X.T @ r
    with_prior = D + np.eye(len(strengths))
    scale, null = (np.array([getattr(p, name) for p in strengths]) for name in ("scale", "null"))
    # Bounds matter: a mass that would have to be negative explains nothing.
    lower, upper = ((np.array([getattr(p, side) for p in strengths]) - null) / scale for side in ("lower", "upper"))
    amount = np.clip(np.linalg.solve(with_prior, u), lower, upper)
    log_bayes = amount @ u - 0.5 * amount @ with_prior @ amount - 0.5 * np.linalg.slogdet(with_prior)[1]
    # First order is trusted within the prior's scale, and a start at nothing at all would have no slope to follow.
    begun = np.array([hypothesis.values[p.name] for p in strengths]) - null
    size = np.copysign(np.clip(np.abs(amount), 1e-3, 1.0), np.where(amount == 0, begun, amount)) * scale
    values = {p.name: float(np.clip(n + s, p.lower, p.upper)) for p, n, s in zip(strengths, null, size, strict=True)}
    known = np.linalg.pinv(D)
    felt = bool(D[0, 0] > 0)
    return Score(
        CauseHypothesis(hypothesis.cause, hypothesis.label, {**hypothesis.values, **values}, {}),
        float(known[0] @ u) * scale[0] if felt else 0.0,
        float(scale[0] * np.sqrt(known[0, 0])) if felt else np.inf,
        float(log_bayes),
    )


def _starts(parameters: tuple[Parameter, ...]) -> Iterator[dict[str, float]]:
    """Every combination of starting values."""
    for combination in product(*(p.starts for p in parameters)):
        yield dict(zip([p.name for p in parameters], combination, strict=True))


def _small_step(strength: Parameter, away: float, *, remakes: bool) -> float:
    """Distance from no effect, towards a start that is `away` from it, so small that first order will do."""
    return float(np.copysign(min(abs(away), difference_step(strength, strength.null, remakes=remakes)), away))
