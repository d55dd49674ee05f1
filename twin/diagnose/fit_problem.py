"""Causes on trial with the base family as one vector of unknowns, and what a fit of them holds where it begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
from scipy.special import ndtr

from twin.arrays import Array
from twin.diagnose.cause import Cause
from twin.identify.base_fit import baseline_bounds
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import largest_step
from twin.identify.measured_data import MeasuredData
from twin.identify.model_modification import ModelModification
from twin.identify.residuals.error_model import ErrorModel
from twin.identify.residuals.frequency_model import FrequencyModel
from twin.identify.residuals.likelihood import residual_model, solves_modes, sound_errors
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.port_forces import Change, PortModel, acts_at_ports, port_changes
from twin.identify.residuals.prediction import Prediction
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.residuals.whitening import HarmonicResiduals


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


def modification_of(evidence: MeasuredData, hypotheses: tuple[CauseHypothesis, ...]) -> ModelModification:
    """All modifications at once."""
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
    hypotheses
        Causes with the values to begin from.
    errors
        What the model may be wrong by beside the noise; as sound rigs' by default.
    held, frozen
        As in :class:`FitOptions`.

    Attributes
    ----------
    x0 : ndarray, (n,)
        The vector at the start.
    mean, precision : ndarray, (n,) and (n, n)
        Of the prior.
    """

    def __init__(
        self,
        evidence: MeasuredData,
        harmonics: HarmonicResiduals | None,
        start: BaselineParameters,
        hypotheses: tuple[CauseHypothesis, ...],
        *,
        errors: ErrorModel | None = None,
        held: tuple[int, str] | None = None,
        frozen: bool = False,
    ) -> None:
        self.evidence, self.harmonics, self.start = evidence, harmonics, start
        self.errors = errors or sound_errors(evidence)
        self._hypotheses = hypotheses
        self.slots = [
            (i, p)
            for i, hypothesis in enumerate(hypotheses)
            for p in hypothesis.cause.parameters(evidence, hypothesis.label)
            if not (frozen or p.is_known or (i, p.name) == held)
        ]
        self.count = len(start.vector)
        self.x0 = np.concatenate([start.vector, [hypotheses[i].values[p.name] / p.scale for i, p in self.slots]])
        located = {i for i, p in self.slots if p.is_location}
        self._scaled = [
            (k, p.null / p.scale)
            for k, (i, p) in enumerate(self.slots, self.count)
            if i in located and not p.is_location
        ]
        self._base = residual_model(evidence, errors=self.errors)
        self._remakes = [solves_modes(evidence, hypothesis.modification(evidence)) for hypothesis in hypotheses]
        base_mean, base_precision = self._base.prior(start)
        self.mean = np.concatenate([base_mean, [p.prior[0] for _, p in self.slots]])
        self.precision = np.diag(np.concatenate([np.zeros(self.count), [p.prior[1] for _, p in self.slots]]))
        self.precision[: self.count, : self.count] = base_precision

    def precision_with(self, errors: ErrorModel) -> Array:
        """The precision (n, n) with another roughness of the joints' laws and other shifts."""
        inferred = self._base.inferred_precision(self.start, errors)
        own, precision = np.flatnonzero(np.diag(inferred)), self.precision.copy()
        # In its place, not as a difference: a smooth curve's determinant hangs on the last digits.
        precision[np.ix_(own, own)] = inferred[np.ix_(own, own)]
        return precision

    @cached_property
    def precision_terms(self) -> list[Array]:
        """What shifts and roughness of one each add to the base family's precision (u, u), by their inverse squares."""

        def inferred(shifts: float, softening: float, loss: float) -> Array:
            errors = replace(self.errors, shifts=shifts, roughness=(softening, loss))
            return self._base.inferred_precision(self.start, errors)

        none = inferred(np.inf, np.inf, np.inf)  # what holds the shifts' mean, whatever their size
        return [inferred(*sizes) - none for sizes in np.where(np.eye(3), 1.0, np.inf).tolist()]

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Lower and upper limits of the vector."""
        own = [(p.lower / p.scale, p.upper / p.scale) for _, p in self.slots]
        lower, upper = (
            np.concatenate([baseline_bounds(self.start, side), [limits[side] for limits in own]]) for side in (0, 1)
        )
        return lower, upper

    @property
    def log_prior_mass(self) -> float:
        """Logarithm of what the priors of strengths have within their limits: half where these have one sign only."""
        strengths = [p for _, p in self.slots if not p.is_location]
        return float(
            sum(np.log(ndtr((p.upper - p.null) / p.scale) - ndtr((p.lower - p.null) / p.scale)) for p in strengths)
        )

    @property
    def largest_step(self) -> Array:
        """Largest change of each parameter in one iteration."""
        largest = np.full(len(self.x0), np.inf)
        largest[: self.start.of_laws.start] = largest_step(self.start.base)
        for k, (_, p) in enumerate(self.slots, self.count):
            largest[k] = 0.1 * (p.upper - p.lower) / p.scale if p.is_location else 1.0
        return largest

    def moved(self, x: Array, step: Array) -> Array:
        """The vector after a step: strengths of causes with a place or threshold by a factor, where it is not large.

        Both make up for each other along a power law, which is nearly straight in the strength's logarithm.
        """
        ahead = x + step
        for k, null in self._scaled:
            size, change = x[k] - null, step[k]
            if abs(change) < 0.5 * abs(size):
                ahead[k] = null + size * np.exp(change / size)
        return np.asarray(ahead)

    def baseline(self, x: Array) -> BaselineParameters:
        """The base family's part."""
        return self.start.with_vector(x[: self.count])

    def hypotheses(self, x: Array, spread: Array | None = None) -> tuple[CauseHypothesis, ...]:
        """The causes with their values, and with their standard deviations where those of the vector are given."""
        tables: list[dict[str, float]] = [dict(hypothesis.values) for hypothesis in self._hypotheses]
        errors: list[dict[str, float]] = [{} for _ in self._hypotheses]
        for k, (i, p) in enumerate(self.slots):
            tables[i][p.name] = float(x[self.count + k] * p.scale)
            if spread is not None:
                errors[i][p.name] = p.spread(tables[i][p.name], float(spread[self.count + k] * p.scale))
        return tuple(
            replace(hypothesis, values=table, std=error)
            for hypothesis, table, error in zip(self._hypotheses, tables, errors, strict=True)
        )

    def residual_model(self, x: Array, held: Linearisation | None = None) -> ResidualModel | FrequencyModel:
        """The model with its causes at their values, and with what is held of it elsewhere."""
        modification = modification_of(self.evidence, self.hypotheses(x))
        return residual_model(self.evidence, modification, self.harmonics, errors=self.errors, held=held)

    def weighed(self, x: Array | None = None) -> WeighedProblem:
        """With what a fit holds that begins at a vector, the start if not given."""
        at = self.x0 if x is None else x
        return WeighedProblem(self, self.residual_model(at).linearisation(self.baseline(at)), at)

    def sides(self, x: Array, number: int, *, coarse: float = 0.0) -> tuple[Array, Array]:
        """Vectors with less and with more of one of the causes' parameters, inside its limits."""
        i, p = self.slots[number - self.count]
        value = x[number] * p.scale
        step = p.difference_step(value, remakes=self._remakes[i], coarse=coarse)
        less, more = x.copy(), x.copy()
        less[number] = max(value - step, p.lower) / p.scale
        more[number] = min(value + step, p.upper) / p.scale
        return less, more

    def slope(self, of: Callable[[Array], Array], x: Array, number: int, *, coarse: float = 0.0) -> Array:
        """Derivative of a function of the vector by one of the causes' parameters: a central difference."""
        less, more = self.sides(x, number, coarse=coarse)
        return np.asarray((of(more) - of(less)) / (more[number] - less[number]))


@dataclass(frozen=True, eq=False)
class WeighedProblem:
    """A problem with what a fit holds from its beginning on: weights, and what harmonics add."""

    problem: FitProblem
    held: Linearisation
    at: Array
    """The vector where it was found."""

    @cached_property
    def here(self) -> Prediction:
        """The whitened residual there, with its sensitivities to all parameters."""
        return self.evaluate(self.at)

    def predict(self, x: Array) -> Prediction:
        """The whitened residual."""
        return self._residual_model(x).evaluate(self.problem.baseline(x), sensitivities=False)

    def evaluate(self, x: Array) -> Prediction:
        """The whitened residual and its sensitivities to all parameters."""
        problem, model, baseline = self.problem, self._residual_model(x), self.problem.baseline(x)
        found, at_ports = model.evaluate(baseline), dict[int, Change]()
        columns = np.empty((len(found.residual), len(problem.slots)))
        for k, (i, _) in enumerate(problem.slots):
            number = problem.count + k
            sides = problem.sides(x, number)
            less, more = (problem.hypotheses(side)[i].modification(problem.evidence) for side in sides)
            if isinstance(model, ResidualModel) and acts_at_ports(more):
                factor = 1 / (sides[1][number] - sides[0][number])
                at_ports[k] = ((more, factor), (less, -factor))
            else:
                columns[:, k] = problem.slope(lambda at: -self.predict(at).residual, x, number)
        if isinstance(model, ResidualModel) and at_ports:
            own, whole = list(at_ports), modification_of(problem.evidence, problem.hypotheses(x))
            with_ports = partial(PortModel, problem.evidence, whole, problem.harmonics, held=self._held(x))
            added = None if self._by_causes is None else self._by_causes[:, :, own]
            changes = port_changes(with_ports, model.model.structure, baseline, list(at_ports.values()), added=added)
            columns[:, own] = np.column_stack(list(changes))
        return replace(found, jacobian=np.column_stack([found.jacobian, columns]))

    @cached_property
    def _by_causes(self) -> Array | None:
        """Derivatives (s, 2 p, k) by the causes' parameters of what harmonics add beside what a residual has anyway.

        Motion at the place of a cause's force goes with that place, and the force's harmonics move the joints.
        """
        if not self.problem.slots or self.held.balance is None:
            return None

        def beyond(x: Array, start: Array | None = None) -> tuple[Array, Array]:
            model = self.problem.residual_model(x, self.held)
            assert isinstance(model, ResidualModel)
            return model.added_beyond(self.held, self.problem.baseline(x), start=start)

        _, start = beyond(self.at)
        by = partial(self.problem.slope, lambda x: beyond(x, start)[0], self.at, coarse=LIMITS.harmonics_step)
        return np.stack([by(number) for number in range(self.problem.count, len(self.at))], axis=2)

    def _held(self, x: Array) -> Linearisation:
        change = (x - self.at)[self.problem.count :]
        return self.held.adding(self._by_causes @ change) if change.any() and self._by_causes is not None else self.held

    def _residual_model(self, x: Array) -> ResidualModel | FrequencyModel:
        return self.problem.residual_model(x, self._held(x))
