"""The score test: what each cause would gain, and how large it may be, at every place where it could sit.

From the residual r of a fit and its sensitivities J, whitened and with their prior as further rows, a cause whose
signatures by its strengths are the columns X, with the unknowns and what sound rigs have of every cause projected out,
has the sizes D^-1 u with the covariance D^-1, where D = X' X and u = X' r.  With priors of unit size its log Bayes
factor is u' (D + 1)^-1 u / 2 - ln det(1 + D) / 2.  No fit for any place.

All that is at one size of the errors.  The model that a cause completes needs smaller ones than the model without it:
so its evidence is the largest over sizes between, of the model's without it there and of the log Bayes factor there.
A law that imitates an effect with large errors leaves little of it to first order: then the model is fitted with a
sound rig's errors alone, and scored there.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import product

import numpy as np

from twin.arrays import Array
from twin.diagnose.cause import Cause, Parameter, strengths_of
from twin.diagnose.fit_problem import CauseHypothesis, FitProblem, WeighedProblem, modification_of
from twin.diagnose.fitted_model import FittedModel
from twin.diagnose.limits import LIMITS
from twin.diagnose.marginal_likelihood import AboutFit, MarginalLikelihood
from twin.diagnose.model_evidence import fit_with_errors
from twin.diagnose.parallel_map import parallel_map
from twin.diagnose.residual_columns import KINDS, ResidualColumns, tolerances_of
from twin.diagnose.selection.law_tolerances import law_tolerances
from twin.identify.cholesky import Cholesky
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.error_model import SPREAD, ErrorModel, log_prior
from twin.identify.residuals.frequency_model import FrequencyModel
from twin.identify.residuals.likelihood import residual_model, solves_modes, sound_errors
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.port_forces import PortModel, acts_at_ports, port_changes
from twin.identify.residuals.prediction import Prediction
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals
from twin.identify.time_limit import time_is_up


@dataclass(frozen=True)
class Score:
    """First order of one cause at one place."""

    hypothesis: CauseHypothesis
    """With the strength that the first order suggests."""
    size: float
    """Its first strength less the one of no effect, as the data alone have it, in the parameter's unit,"""
    std: float
    """and its standard deviation; infinite where the data say nothing of it."""
    log_bayes: float
    """Expected gain of log evidence."""
    change: Array
    """Of the base family's unknowns, to where they are most probable beside it, (u,)."""


@dataclass(frozen=True)
class _Signature:
    """Change (r, k) of the whitened residual with a cause's strengths in units of their scales, at one place.

    Where the effect has no strength, with the whole of it.  There are so many thresholds to each place.
    """

    hypothesis: CauseHypothesis
    strengths: tuple[Parameter, ...]
    columns: Array
    thresholds: int

    @property
    def tolerated(self) -> Array:
        """What a sound rig may have of it: shared out among the thresholds, of which it has one."""
        return np.asarray(self.columns * [p.tolerance / np.sqrt(self.thresholds) for p in self.strengths])


@dataclass(frozen=True)
class _Signatures:
    """Signatures of causes beside one model, with a sound rig's weights and priors.

    A cause gains by explaining what a loose fit put down to natural frequencies.
    """

    weighed: WeighedProblem
    each: list[_Signature]
    left_by: _LeftBy

    @classmethod
    def at(
        cls,
        evidence: MeasuredData,
        harmonics: HarmonicResiduals | None,
        model: FittedModel,
        causes: Mapping[str, Cause],
    ) -> _Signatures:
        weighed = FitProblem(evidence, harmonics, model.baseline, model.hypotheses, frozen=True).weighed()
        left_by = _LeftBy.at(weighed, model)
        found = parallel_map(_signatures_of, (left_by, weighed.here), [(cause,) for cause in causes.values()])
        return cls(weighed, [signature for each in found for signature in each], left_by)

    def tolerances(self) -> ResidualColumns:
        """What a sound rig may have of every cause, and of what a joint's law leaves out."""
        problem, held, here = self.weighed.problem, self.weighed.held, self.weighed.here
        tolerated = [signature.tolerated for signature in self.each if signature.strengths]
        plain = self.left_by.changed(ModelModification())
        if isinstance(plain, ResidualModel):
            white, of_laws = law_tolerances(plain, problem.start, here.residual, self.left_by)
            tolerated += [*white, *(columns.whitened(held) for columns in of_laws)]
        columns = np.column_stack([np.zeros((len(here.residual), 0)), *tolerated])
        columns = _principal(_beside_unknowns(columns, here.jacobian, problem))
        return tolerances_of(columns, here.blocks, held)


def score_causes(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    model: FittedModel,
    causes: Mapping[str, Cause],
    *,
    errors: ErrorModel | None = None,
    refitted: bool = False,
) -> tuple[list[Score], ResidualColumns, FittedModel]:
    """Score every cause, label and starting place against the residual of `model`, best first, while there is time.

    Parameters
    ----------
    errors
        What the model needs; `model`'s own by default.
    refitted
        Whether the model is first fitted beside what a sound rig may have, and scored where it ends.

    Returns
    -------
    list of Score
    ResidualColumns
        What a sound rig may have of every cause, and what is no sign of any therefore.
    FittedModel
        That was scored.
    """
    found = _Signatures.at(evidence, harmonics, model, causes)
    tolerances, errors, sound = found.tolerances(), errors or model.errors, sound_errors(evidence)
    if refitted:
        model = fit_with_errors(
            evidence, harmonics, model.baseline, model.hypotheses, errors=errors, tolerances=tolerances
        )
        # Anew: a sensitivity of a hundred thousand deviations changes by many where moduli move by a thousandth.
        found, errors = _Signatures.at(evidence, harmonics, model, causes), model.errors
    weighed, signatures = found.weighed, found.each
    if not signatures:
        return [], tolerances, model
    first_orders = _FirstOrders.of(signatures, weighed.here.blocks, weighed.held)
    marginal, sizes = MarginalLikelihood(weighed, tolerances), _between(errors, sound)
    alone, gains = np.full(len(sizes) ** 2, -np.inf), []
    for number, (own, runs) in enumerate(product(sizes, sizes)):
        trial = replace(own, broadband=runs.broadband)
        about = marginal.at(trial)
        alone[number] = about.log_likelihood + log_prior(trial, sound)
        gains.append(first_orders.beside(marginal, about, trial))
    best = np.argmax([without + gain.log_bayes for without, gain in zip(alone, gains, strict=True)], axis=0)
    scores = [
        gains[at].score(number, signature, alone[at] - np.max(alone), len(model.baseline.vector))
        for number, (signature, at) in enumerate(zip(signatures, best, strict=True))
    ]
    return sorted(scores, key=lambda score: -score.log_bayes), tolerances, model


def _between(errors: ErrorModel, sound: ErrorModel) -> list[ErrorModel]:
    """Errors from those that a model needs to a sound rig's, no two neighbours farther apart than sound rigs are."""
    start, end = errors.log_sizes, sound.log_sizes
    count = 2 + int(np.max(np.abs(end - start)) / SPREAD)
    return [errors.with_log_sizes(start + share * (end - start)) for share in np.linspace(0.0, 1.0, count)]


@dataclass(frozen=True)
class _LeftBy:
    """What a modification of a fitted model leaves as its whitened residual.

    With what harmonics add beside it, as moduli have: otherwise two per cent of a soft joint would be no moduli's.
    """

    evidence: MeasuredData
    harmonics: HarmonicResiduals | None
    model: FittedModel
    held: Linearisation
    before: tuple[Array, Array] | None = None
    """What harmonics add without it, and the openings' harmonics, see :meth:`ResidualModel.added_beyond`."""

    @classmethod
    def at(cls, weighed: WeighedProblem, model: FittedModel) -> _LeftBy:
        problem, held = weighed.problem, weighed.held
        found = cls(problem.evidence, problem.harmonics, model, held)
        plain = found.changed(ModelModification())
        if held.balance is None or not isinstance(plain, ResidualModel):
            return found
        return replace(found, before=plain.added_beyond(held, model.baseline))

    def changed(self, modification: ModelModification) -> ResidualModel | FrequencyModel:
        """The model with the modification."""
        whole = modification_of(self.evidence, self.model.hypotheses).merged(modification)
        return residual_model(self.evidence, whole, self.harmonics, held=self.held)

    def __call__(self, modification: ModelModification) -> Array:
        """The residual (r,)."""
        changed, baseline = self.changed(modification), self.model.baseline
        if self.before is not None and isinstance(changed, ResidualModel):
            before, start = self.before
            more = changed.added_beyond(self.held, baseline, start=start)[0] - before
            if np.isfinite(more).all():  # a layer whose lost contact has no balance adds what it did
                changed = changed.holding(self.held.adding(more))
        return changed.evaluate(baseline, sensitivities=False).residual


def _beside_unknowns(columns: Array, jacobian: Array, problem: FitProblem) -> Array:
    """What columns (r, k) do that no moduli, damping and law do as well.

    These are then what describes a rig best that has the amounts, and a fit that knows nothing of amounts is about
    where it is most probable.  Whole columns are thousands of deviations large, of which first order tells nothing.
    Natural frequencies are known too well beforehand to take anything over, and what is at its limit cannot.
    """
    lower, upper = problem.bounds
    vague = (lower < problem.x0) & (problem.x0 < upper)
    for known in ("frequency_discrepancy", "shown", "shifts"):
        vague[problem.start.blocks[known]] = False
    J, precision = jacobian[:, vague], problem.precision[np.ix_(vague, vague)]
    return np.asarray(columns - J @ Cholesky.of(J.T @ J + precision).solve(J.T @ columns))


def _principal(columns: Array) -> Array:
    """The fewest columns that have the same covariance, but for what no data of this length could tell."""
    square, V = np.linalg.eigh(columns.T @ columns)
    return np.asarray(columns @ V[:, square > LIMITS.score_test_felt**2])


def _signatures_of(left_by: _LeftBy, prediction: Prediction, cause: Cause) -> list[_Signature]:
    """Signatures of every label and starting place of one cause."""
    evidence, plain, rows = left_by.evidence, left_by.changed(ModelModification()), len(prediction.residual)
    found: list[_Signature] = []
    little: list[tuple[ModelModification, Array]] = []
    for label in cause.labels(evidence):
        if time_is_up():
            break
        parameters = cause.parameters(evidence, label)
        strengths = strengths_of(parameters)
        count = int(np.prod([len(p.starts) for p in parameters if p.is_threshold]))
        for start in _starts(parameters):
            columns = np.empty((rows, max(1, len(strengths))))
            if not strengths:
                columns[:, 0] = prediction.residual - left_by(cause.modification(evidence, label, start))
            # A structure made anew differs a little from the assumed one, without any effect in it.
            remakes = solves_modes(evidence, cause.modification(evidence, label, start))
            none = {**start, **{p.name: p.null for p in strengths}}
            anew = remakes and strengths
            before = left_by(cause.modification(evidence, label, none)) if anew else prediction.residual
            for k, p in enumerate(strengths):
                step = _small_step(p, start[p.name] - p.null, remakes=remakes)
                change = cause.modification(evidence, label, {**none, p.name: p.null + step})
                columns[:, k] = p.scale / step
                if isinstance(plain, ResidualModel) and acts_at_ports(change):
                    little.append((change, columns[:, k]))
                else:
                    columns[:, k] *= before - left_by(change)
            found.append(_Signature(CauseHypothesis(cause, label, start, {}), strengths, columns, count))
    if isinstance(plain, ResidualModel):
        small = [((modification, 1.0),) for modification, _ in little]
        whole = modification_of(evidence, left_by.model.hypotheses)
        with_ports = partial(PortModel, evidence, whole, left_by.harmonics, held=left_by.held)
        changes = port_changes(with_ports, plain.model.structure, left_by.model.baseline, small)
        for (_, column), by_port in zip(little, changes, strict=True):
            column *= by_port
    return [signature for signature in found if np.isfinite(signature.columns).all()]


@dataclass(frozen=True)
class _FirstOrders:
    """All signatures side by side."""

    columns: ResidualColumns
    """Of g signatures with m strengths each, in units of their scales; zeros where one has fewer."""
    lower: Array
    upper: Array
    """Limits of the strengths (g, m), away from no effect; both one where an effect has no strength."""
    sized: Array
    """Whether it has one, with a prior, (g,) bool."""
    known: dict[tuple[str, object], tuple[Array, Array]] = field(default_factory=dict)

    @classmethod
    def of(
        cls, signatures: Sequence[_Signature], blocks: tuple[tuple[str, slice], ...], held: Linearisation
    ) -> _FirstOrders:
        most = max(signature.columns.shape[1] for signature in signatures)
        rows = np.zeros((len(signatures[0].columns), len(signatures), most))
        lower, upper = np.zeros((2, len(signatures), most))
        for number, signature in enumerate(signatures):
            rows[:, number, : signature.columns.shape[1]] = signature.columns
            lower[number, 0] = upper[number, 0] = 1.0
            for k, p in enumerate(signature.strengths):
                # Bounds matter: a mass that would have to be negative explains nothing.
                lower[number, k], upper[number, k] = (p.lower - p.null) / p.scale, (p.upper - p.null) / p.scale
        sized = np.array([bool(signature.strengths) for signature in signatures])
        return cls(ResidualColumns.of(rows.reshape(len(rows), -1), blocks, held), lower, upper, sized)

    def _products(self, marginal: MarginalLikelihood, kind: str, errors: ErrorModel) -> tuple[Array, Array]:
        """Products (1 + n, g, m) of a model's columns with these, and (g, m, m) of each signature's own."""
        key = (kind, getattr(errors, kind))
        if key not in self.known:
            whitenings = marginal.whitenings(kind, errors)
            X = self.columns.white(kind, whitenings).reshape(-1, *self.lower.shape)
            own = np.einsum("rgi,rgj->gij", X, X)
            self.known[key] = np.tensordot(marginal.columns.white(kind, whitenings), X, (0, 0)), own
        return self.known[key]

    def beside(self, marginal: MarginalLikelihood, about: AboutFit, errors: ErrorModel) -> _Gains:
        """What they gain beside a model with these errors."""
        pairs = [self._products(marginal, kind, errors) for kind in KINDS]
        shared, own = (np.sum(each, axis=0) for each in zip(*pairs, strict=True))
        free = about.free
        by_unknowns = shared[1:][free].reshape(np.count_nonzero(free), -1)
        taken_over = Cholesky.of(about.information[np.ix_(free, free)]).solve(by_unknowns)
        grouped = (-1, *self.lower.shape)
        taken_over, by_unknowns = taken_over.reshape(grouped), by_unknowns.reshape(grouped)
        D = own - np.einsum("ngi,ngj->gij", by_unknowns, taken_over)
        u = shared[0] - np.tensordot(about.step[free], by_unknowns, 1)
        with_prior = D + np.eye(D.shape[1])
        amount = np.clip(np.linalg.solve(with_prior, u[..., None])[..., 0], self.lower, self.upper)
        follows = np.zeros((len(free), *self.lower.shape))
        follows[free] = taken_over
        fall = 2 * u - np.einsum("gij,gj->gi", D, amount) - self.sized[:, None] * amount
        volume = np.where(self.sized, np.linalg.slogdet(with_prior)[1], 0.0)
        return _Gains(D, u, amount, 0.5 * (np.einsum("gi,gi->g", amount, fall) - volume), about.step, follows)


@dataclass(frozen=True)
class _Gains:
    """First order of all signatures with some errors: D (g, m, m), u and amounts (g, m), and log Bayes factors (g,).

    The unknowns move by `step` (n,) beside none of them, and by `follows` (n, g, m) less per amount.
    """

    D: Array
    u: Array
    amount: Array
    log_bayes: Array
    step: Array
    follows: Array

    def score(self, number: int, signature: _Signature, more: float, unknowns: int) -> Score:
        """The score of one signature, whose gain counts with so much more, beside so many unknowns."""
        hypothesis, strengths = signature.hypothesis, signature.strengths
        log_bayes = float(self.log_bayes[number] + more)
        step, follows = self.step[:unknowns], self.follows[:unknowns, number]
        if not strengths:
            return Score(hypothesis, 0.0, np.inf, log_bayes, step - follows[:, 0])
        count = len(strengths)
        D, u, amount = self.D[number, :count, :count], self.u[number, :count], self.amount[number, :count]
        scale, null = (np.array([getattr(p, name) for p in strengths]) for name in ("scale", "null"))
        # First order is trusted within the prior's scale; a start at nothing at all would have no slope to follow.
        begun = np.array([hypothesis.values[p.name] for p in strengths]) - null
        size = np.copysign(np.clip(np.abs(amount), 1e-3, 1.0), np.where(amount == 0, begun, amount)) * scale
        each = zip(strengths, null, size, strict=True)
        values = {p.name: float(np.clip(n + s, p.lower, p.upper)) for p, n, s in each}
        amounts = np.array([(values[p.name] - p.null) / p.scale for p in strengths])
        covariance = np.linalg.pinv(D)
        felt = bool(D[0, 0] > 0)
        return Score(
            replace(hypothesis, values={**hypothesis.values, **values}, std={}),
            float(covariance[0] @ u) * scale[0] if felt else 0.0,
            float(scale[0] * np.sqrt(covariance[0, 0])) if felt else np.inf,
            log_bayes,
            step - follows[:, :count] @ amounts,
        )


def _starts(parameters: tuple[Parameter, ...]) -> Iterator[dict[str, float]]:
    """Every combination of starting values."""
    for combination in product(*(p.starts for p in parameters)):
        yield dict(zip([p.name for p in parameters], combination, strict=True))


def _small_step(strength: Parameter, away: float, *, remakes: bool) -> float:
    """Distance from no effect, towards a start that is `away` from it, so small that first order will do."""
    return float(np.copysign(min(abs(away), strength.difference_step(strength.null, remakes=remakes)), away))
