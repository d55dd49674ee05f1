"""A model on trial: the base family extended by causes at given values, refitted with its evidence."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.diagnose.cause import Cause, Parameter
from twin.identify.base_fit import REWEIGHTED, baseline_bounds
from twin.identify.baseline_parameters import STIFF, TIGHT, BaselineParameters, DiscrepancyLevel
from twin.identify.gauss_newton import Solution, minimise
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residual_model import Linearisation, Prediction, ResidualModel
from twin.identify.whitening import HarmonicResiduals

__all__ = ["CauseHypothesis", "FitProblem", "FittedModel", "fit_model", "modification_of"]

Array = NDArray[Any]

ROUGH = 1.0
"""Tolerance from which on a fit only ranks rivals, and keeps the weights that it begins with."""
LARGEST_BASE_STEP = {
    "log_E": 0.3,
    "log_G": 0.3,
    "loss_E": 0.05,
    "loss_G": 0.3,
    "log_zeta": 1.0,
    "frequency_discrepancy": 0.01,
}
"""Of the base parameters in one step of a fit."""


@dataclass(frozen=True)
class CauseHypothesis:
    """One cause with its label and the values of its parameters."""

    cause: Cause
    label: Mapping[str, str]
    values: Mapping[str, float]
    std: Mapping[str, float]

    @property
    def key(self) -> str:
        """Name and label, such as ``channel-gain acc1``."""
        return " ".join([self.cause.name, *self.label.values()])

    def modification(self, evidence: MeasuredData) -> ModelModification:
        """How it acts in a prediction."""
        return self.cause.modification(evidence, self.label, self.values)

    def nonlinear(self, evidence: MeasuredData) -> bool:
        """Whether its effect depends on the amplitude of the place where it acts."""
        modification = self.modification(evidence)
        return bool(modification.nonlinear or modification.opening)


@dataclass(frozen=True)
class FittedModel:
    """A fitted model.

    Attributes
    ----------
    names : tuple of CauseHypothesis
        What it names; empty for the base family.
    log_evidence : float
        Laplace's approximation of the log marginal likelihood, up to a constant that all models share.
    blocks : tuple of (name, slice)
        Parts of the residual, as in :class:`~twin.identify.prediction.Prediction`.
    """

    hypotheses: tuple[CauseHypothesis, ...]
    baseline: BaselineParameters
    solution: Solution
    log_evidence: float
    dof: int
    blocks: tuple[tuple[str, slice], ...] = ()

    @property
    def chi2_per_dof(self) -> float:
        """Of all evidence."""
        return self.solution.chi2 / max(1, self.dof)

    def chi2_of(self, block: str) -> float:
        """Of the parts of the evidence with this name."""
        parts = [self.solution.residual[part] for name, part in self.blocks if name == block]
        return float(sum(part @ part for part in parts))

    @property
    def chi2_per_number(self) -> dict[str, float]:
        """Of each part of the evidence."""
        counts = {name: sum(p.stop - p.start for part, p in self.blocks if part == name) for name, _ in self.blocks}
        return {name: self.chi2_of(name) / max(1, count) for name, count in counts.items()}

    def weight(self, overdispersion: float) -> float:
        """Log evidence with chi2 divided by `overdispersion`, the variance by which the best model misses its noise."""
        return self.log_evidence + 0.5 * self.solution.chi2 * (1 - 1 / max(1.0, overdispersion))


def modification_of(evidence: MeasuredData, hypotheses: tuple[CauseHypothesis, ...]) -> ModelModification:
    """All extensions at once."""
    whole = ModelModification()
    for hypothesis in hypotheses:
        whole = whole.merged(hypothesis.modification(evidence))
    return whole


class FitProblem:
    """All parameters of a model on trial in one vector: the base family's unknowns, then the causes'.

    A cause's parameters are in units of their scale, so that one step length suits all.

    Parameters
    ----------
    start
        Where the base family's unknowns begin.
    names
        Causes with the values to begin from.
    discrepancy
        How much the models may be wrong beyond their noise.
    held
        Parameter of the last cause that keeps its value.

    Attributes
    ----------
    x0 : ndarray, (n,)
        The vector at the start.
    blocks : tuple of (name, slice)
        Parts of the residual that was evaluated last.
    """

    def __init__(
        self,
        evidence: MeasuredData,
        harmonics: HarmonicResiduals | None,
        start: BaselineParameters,
        hypotheses: tuple[CauseHypothesis, ...],
        *,
        discrepancy: DiscrepancyLevel = TIGHT,
        held: str = "",
    ) -> None:
        self.evidence, self.harmonics, self.start, self.discrepancy = evidence, harmonics, start, discrepancy
        self._hypotheses = hypotheses
        self.slots = [
            (i, p)
            for i, hypothesis in enumerate(hypotheses)
            for p in hypothesis.cause.parameters(evidence, hypothesis.label)
            if i < len(hypotheses) - 1 or p.name != held
        ]
        self.count = len(start.vector)
        self.scales = np.array([p.scale for _, p in self.slots])
        self.x0 = np.concatenate([start.vector, [hypotheses[i].values[p.name] / p.scale for i, p in self.slots]])
        self.blocks: tuple[tuple[str, slice], ...] = ()
        self._held: Linearisation | None = None
        self._remakes = [hypothesis.modification(evidence).changes_structure for hypothesis in hypotheses]

    def baseline(self, x: Array) -> BaselineParameters:
        """The base family's part."""
        return self.start.with_vector(x[: self.count])

    def hypotheses(self, x: Array) -> tuple[CauseHypothesis, ...]:
        """The causes with their values."""
        tables: list[dict[str, float]] = [dict(hypothesis.values) for hypothesis in self._hypotheses]
        for (i, p), value in zip(self.slots, x[self.count :] * self.scales, strict=True):
            tables[i][p.name] = float(value)
        return tuple(
            replace(hypothesis, values=table) for hypothesis, table in zip(self._hypotheses, tables, strict=True)
        )

    def weigh(self, x: Array) -> None:
        """From now on hold what a fit holds that begins here."""
        residual_model = ResidualModel(
            self.evidence,
            modification_of(self.evidence, self.hypotheses(x)),
            self.harmonics,
            discrepancy=self.discrepancy,
        )
        self._held = residual_model.linearisation(self.baseline(x))

    def predict(self, x: Array, *, sensitivities: bool = False) -> Prediction:
        """The whitened residual, with its sensitivities to the base family if they are wanted."""
        modification = modification_of(self.evidence, self.hypotheses(x))
        residual_model = ResidualModel(
            self.evidence, modification, self.harmonics, discrepancy=self.discrepancy, held=self._held
        )
        return residual_model.evaluate(self.baseline(x), sensitivities=sensitivities)

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """The whitened residual and its sensitivities to all parameters."""
        here = self.predict(x, sensitivities=True)
        r, self.blocks = here.residual, here.blocks
        columns = np.zeros((len(r), len(self.slots)))
        for k, (i, p) in enumerate(self.slots):
            step = _difference_step(p, x[self.count + k] * self.scales[k], remakes=self._remakes[i]) / p.scale
            moved = x.copy()
            moved[self.count + k] += step
            columns[:, k] = (r - self.predict(moved).residual) / step
        return r, np.hstack([here.jacobian, columns])


def fit_model(
    evidence: MeasuredData,
    harmonics: HarmonicResiduals | None,
    start: BaselineParameters,
    hypotheses: tuple[CauseHypothesis, ...],
    *,
    discrepancy: DiscrepancyLevel = TIGHT,
    iterations: int = 20,
    tolerance: float = 0.1,
    held: str = "",
) -> FittedModel:
    """Refit the base family together with the causes' parameters.

    Parameters
    ----------
    start, names, discrepancy, held
        As for :class:`FitProblem`.
    iterations, tolerance
        Of the Gauss-Newton search.
    """
    shared = []
    for hypothesis in hypotheses:
        start, values = hypothesis.cause.shared(evidence, hypothesis.label, start, hypothesis.values)
        shared.append(replace(hypothesis, values=values))
    trial = FitProblem(evidence, harmonics, start, tuple(shared), discrepancy=discrepancy, held=held)
    parameters, count = [p for _, p in trial.slots], trial.count
    base_mean, base_precision = ResidualModel(evidence, discrepancy=discrepancy).prior(start)
    mean = np.concatenate([base_mean, [p.prior[0] for p in parameters]])
    precision = np.zeros((len(mean), len(mean)))
    precision[:count, :count] = base_precision
    for k, p in enumerate(parameters):
        precision[count + k, count + k] = p.prior[1]
    base_lower, base_upper = (baseline_bounds(start, side) for side in (0, 1))
    lower = np.concatenate([base_lower, [p.lower / p.scale for p in parameters]])
    upper = np.concatenate([base_upper, [p.upper / p.scale for p in parameters]])
    largest = np.concatenate([_largest_base_steps(start), np.full(len(parameters), 1.0)])
    for k, p in enumerate(parameters):
        if p.places:
            largest[count + k] = 0.1 * (p.upper - p.lower) / p.scale
    x = trial.x0
    # With discrepancy the weights hardly depend on the law; rough fits, or those at a held value, are many to choose
    # from.
    final = discrepancy in (TIGHT, STIFF) and tolerance < ROUGH and not held
    for _ in range(REWEIGHTED if final else 1):
        trial.weigh(x)
        solution = minimise(
            trial.evaluate,
            x,
            mean=mean,
            precision=precision,
            bounds=(lower, upper),
            iterations=iterations,
            tolerance=tolerance,
            largest_step=largest,
            residual_alone=lambda x: trial.predict(x).residual,
        )
        x = solution.x
        if solution.gained_little(tolerance):
            break
    std = np.sqrt(np.diag(solution.covariance))[count:] * trial.scales
    found = []
    for i, hypothesis in enumerate(trial.hypotheses(x)):
        errors = {p.name: p.spread(hypothesis.values[p.name], std[k]) for k, (j, p) in enumerate(trial.slots) if j == i}
        found.append(replace(hypothesis, std=errors))
    return FittedModel(
        hypotheses=tuple(found),
        baseline=trial.baseline(x),
        solution=solution,
        log_evidence=log_evidence(solution, base_precision, parameters),
        dof=len(solution.residual) - _free_count(solution),
        blocks=trial.blocks,
    )


def log_evidence(solution: Solution, base_precision: Array, parameters: list[Parameter]) -> float:
    """Laplace's approximation of the log marginal likelihood, up to a constant that all models share."""
    A = solution.information
    value = -0.5 * (solution.chi2 + solution.penalty)
    value -= 0.5 * (np.linalg.slogdet(A)[1] - np.linalg.slogdet(base_precision)[1])
    value += 0.5 * sum(np.log(p.prior[1]) for p in parameters)
    return float(value)


def _difference_step(parameter: Parameter, value: float, *, remakes: bool) -> float:
    """Step of the difference quotient in a cause's parameter, away from its upper bound.

    Small for a strength or a threshold, because near a sharp resonance the residual bends within a thousandth of a
    stiffness; coarser along the structure.  Where a cause remakes the structure its modes are solved anew, and
    their rounding is a millionth of a usual strength: a step of that size finds some tenths of the sensitivity to be
    noise, and the fit creeps.
    """
    along = parameter.places and "position" in parameter.name
    size = parameter.scale + (0.0 if parameter.places else abs(value - parameter.null))
    step = (1e-3 if along else 3e-4 if remakes else 1e-6) * size
    return -step if value + step > parameter.upper else step


def _largest_base_steps(baseline: BaselineParameters) -> Array:
    steps = np.full(len(baseline.blocks), np.inf)
    steps[: baseline.of_laws.start] = baseline.base.blocks(baseline.base.joints).pack(LARGEST_BASE_STEP)
    return steps


def _free_count(solution: Solution) -> int:
    """Parameters that the data determine rather than the prior, rounded."""
    data = solution.jacobian.T @ solution.jacobian
    return round(float(np.trace(np.linalg.solve(solution.information, data))))
