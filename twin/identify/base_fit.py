"""Fit the base family - linear parameters and the joint's law - to all evidence at once."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.baseline_parameters import BaselineParameters
from twin.identify.frequency_shifts import unshifted
from twin.identify.gauss_newton import Solution, StepRule, minimise, minimise_reweighted
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_fit import base_bounds, largest_step
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.nonlinear.balance import Added, Balance
from twin.identify.nonlinear.joint_law import LayerLaw, choose_knots, spacing, spline_basis
from twin.identify.nonlinear.opening_harmonics import balance_openings
from twin.identify.residuals.error_model import ErrorModel, continuation
from twin.identify.residuals.frequency_model import FrequencyModel, starting_moduli
from twin.identify.residuals.likelihood import nominal_base, residual_model, sound_errors
from twin.identify.residuals.linearisation import Linearisation
from twin.identify.residuals.natural_frequencies import MeasuredFrequencies
from twin.identify.residuals.residual_model import ResidualModel

TURNS = 25
"""Newton steps for each step's own softening and loss; eight are usual."""
HARMONIC_TURNS = 6
"""Of the law and of what harmonics add to it, one found from the other."""
MOST_STIFFENED, MOST_SOFTENED = -LIMITS.softening_of_a_step[0], LIMITS.softening_of_a_step[1]
"""Shares of E' that a law may take off or add."""
HELD_PRECISION = 1e16
"""Of an unknown that is held: so small an uncertainty moves nothing, and the information stays invertible."""


@dataclass(frozen=True)
class BaseFit:
    """A fit of the base family."""

    baseline: BaselineParameters
    solution: Solution
    errors: ErrorModel
    """Of the last search: those that were asked for, or larger ones where these could not be followed."""


def starting_baseline(evidence: MeasuredData) -> BaselineParameters:
    """Base parameters of the broadband fit, else what is assumed, and a law read off the steps one by one."""
    base = evidence.linear.base if evidence.linear else nominal_base(evidence)
    return law_from_steps(residual_model(evidence), base)


def _starting_baselines(evidence: MeasuredData) -> list[BaselineParameters]:
    """Where fits begin: natural frequencies alone have several minima."""
    if isinstance(evidence, MeasuredFrequencies):
        return [BaselineParameters(base, ()) for base in starting_moduli(evidence)]
    return [starting_baseline(evidence)]


def law_from_steps(residual_model: ResidualModel | FrequencyModel, base: LinearParameters) -> BaselineParameters:
    """The laws that reproduce each step's reference channel, smoothed onto knots that follow the layers' own motion.

    For each step by itself one softening and one loss are found that all points share, as parts of their joint's E', by
    Newton's method on the inverse of the response, which near one resonance is almost linear in the moduli: it
    converges from linear joints even where the resonance has moved by many of its widths.  A point counts in what is
    found by its part in the energy, that is by the square of its motion; a step counts in a joint's law as far as the
    response feels that joint.
    """
    evidence = residual_model.evidence
    if isinstance(residual_model, FrequencyModel) or not len(evidence.steps) or not len(residual_model.points):
        nowhere = choose_knots(np.zeros(0), LIMITS.joint_law_knots)
        laws = (LayerLaw.zero(nowhere, nowhere),) * residual_model.laws
        return BaselineParameters(base, laws, evidence.as_modelled, unshifted(evidence))
    steps, time, p = evidence.steps, residual_model.step_times, len(residual_model.points)
    omega = residual_model.clock(steps.complex_omega, time)
    free = residual_model.receptance(omega, base, time, inner=False, points=True, drive=steps.drive)
    around = residual_model.surroundings(free, omega)
    E = residual_model.moduli[0][residual_model.points.joint]
    weights = residual_model.local.weights * np.concatenate([E, E])
    n = len(residual_model.moving)
    s, loss = np.zeros((2, len(omega)))
    for _ in range(TURNS):
        stiffness = np.zeros((len(omega), n), complex)
        stiffness[:, :p], stiffness[:, p : 2 * p] = -s[:, None] * weights[:, :p], 1j * loss[:, None] * weights[:, p:]
        if residual_model.local.forces:
            laws = _smoothed(residual_model, s, loss, around.motion(stiffness))
            stiffness[:, 2 * p :] = residual_model.local.balance(laws, omega, around).stiffness[:, 2 * p :]
        motion, reading, by_stiffness = around.reading(stiffness)
        # d(1/H) H = -dH/H; both unknowns are real, the equation is complex.
        gap = reading * steps.force[:, 0] / steps.response[:, evidence.reference, 0] - 1
        each = by_stiffness[:, : 2 * p] * weights
        a, b = np.sum(each[:, :p], axis=1), -1j * np.sum(each[:, p:], axis=1)
        determinant = a.real * b.imag - a.imag * b.real
        ds = (gap.real * b.imag - gap.imag * b.real) / determinant
        dl = (a.real * gap.imag - a.imag * gap.real) / determinant
        s = np.clip(s + np.clip(ds, -0.3, 0.3), *LIMITS.softening_of_a_step)
        loss = np.clip(loss + np.clip(dl, -1.0, 1.0), -0.1 * LIMITS.largest_loss, LIMITS.largest_loss)
    of_harmonics, found = np.zeros_like(s), Balance(motion, stiffness, Added.nothing(motion.shape, p), np.abs(gap))
    for _ in range(HARMONIC_TURNS):
        laws = _smoothed(residual_model, s - of_harmonics, loss, motion, each, found.unsettled)
        of_harmonics = _softened_by_harmonics(residual_model, BaselineParameters(base, laws), found)
    return BaselineParameters(base, laws, evidence.as_modelled, unshifted(evidence))


def _softened_by_harmonics(residual_model: ResidualModel, baseline: BaselineParameters, found: Balance) -> Array:
    """What the openings' harmonics take off at each step (s,), over E', as all points together feel it."""
    openings = residual_model.openings(baseline, found)
    more = balance_openings(baseline.laws, openings, residual_model.slaps).more.real
    energy = np.abs(openings.fundamental) ** 2
    whole = np.sum(openings.weight * openings.modulus[openings.joint] * energy, axis=1)
    return np.asarray(-np.sum(more * energy, axis=1) / np.where(whole == 0, 1.0, whole))


def _smoothed(
    residual_model: ResidualModel, s: Array, loss: Array, motion: Array, by_moduli: Array | None = None,
    gap: Array | float = 0.0,
) -> tuple[LayerLaw, ...]:  # fmt: skip
    """Splines through what the steps show of each joint, each weighted by how much it shows it.

    Parameters
    ----------
    s, loss : ndarray, (s,)
        Over E'.
    by_moduli : ndarray, (s, 2 p)
        Relative change of the response with that of each point.
    """
    p, weights, laws = len(residual_model.points), residual_model.local.weights, []
    knots = LIMITS.joint_law_knots
    for joint, E in enumerate(residual_model.moduli[0]):
        own, found = residual_model.local.of_joint(joint), []
        for values, at in ((s, own), (loss, p + own)):
            amplitude = np.abs(motion[:, at])
            x = choose_knots(amplitude, knots)
            energy = weights[:, at] * amplitude**2
            B = np.einsum("sp,spk->sk", energy / energy.sum(axis=1, keepdims=True), spline_basis(x, amplitude)[0])
            weight = 1.0 if by_moduli is None else np.abs(np.sum(by_moduli[:, at], axis=1))
            weight = np.broadcast_to(weight, len(values)) * (gap < LIMITS.read_off)
            weight = np.minimum(weight, 3 * np.median(weight))
            weight = weight / (np.max(weight) or 1.0)
            straight = LIMITS.base_fit_smoothness * spacing(x) ** -1.5 * np.diff(np.eye(knots), 2, axis=0)
            rows = np.vstack([weight[:, None] * B, straight, 1e-3 * np.eye(knots)])
            right = np.concatenate([weight * values, np.zeros(len(rows) - len(values))])
            found.append((x, np.linalg.lstsq(rows, right, rcond=None)[0]))
        (opening, softening), (slip, losing) = found
        softening = np.clip(softening, -MOST_STIFFENED, MOST_SOFTENED)
        laws.append(LayerLaw(opening, slip, E * softening, E * np.maximum(losing, 0.0)))
    return tuple(laws)


def baseline_bounds(baseline: BaselineParameters, side: int) -> Array:
    """Lower (0) or upper (1) limits of the unknowns' vector: a layer gives no energy away, and keeps some stiffness."""
    softening, loss = ((-MOST_STIFFENED, 0.0), (MOST_SOFTENED, np.inf))[side]
    bounds = np.empty(len(baseline.blocks))
    bounds[: baseline.of_laws.start] = base_bounds(baseline.base.joints)[side]
    bounds[baseline.blocks["shown"]] = bounds[baseline.blocks["shifts"]] = (-np.inf, np.inf)[side]
    for joint, (_, E) in enumerate(zip(baseline.laws, baseline.base.E, strict=False)):
        bounds[baseline.softening(joint)], bounds[baseline.loss(joint)] = softening * E, loss
    return bounds


def fit_base(
    evidence: MeasuredData,
    *,
    start: BaselineParameters | None = None,
    errors: ErrorModel | None = None,
    tolerance: float = LIMITS.base_fit_tolerance,
    held_at_zero: Sequence[int] = (),
) -> BaseFit:
    """Fit base parameters and law, through model errors from large ones down to `errors`, as far as data are followed.

    Parameters
    ----------
    start
        Where to begin; read off the evidence by default.
    errors
        Those of sound rigs by default.
    tolerance
        Of the last fit, as :data:`LIMITS.base_fit_tolerance`.
    held_at_zero
        Places in the unknowns' vector that are not free.
    """
    fits = [
        _fitted_from(evidence, begun, errors or sound_errors(evidence), tolerance, np.asarray(held_at_zero, int))
        for begun in ([start] if start else _starting_baselines(evidence))
    ]
    return min(fits, key=lambda fit: fit.solution.cost)


def _fitted_from(
    evidence: MeasuredData, baseline: BaselineParameters, errors: ErrorModel, tolerance: float, held: NDArray[np.int64]
) -> BaseFit:
    if len(held):
        vector = baseline.vector
        vector[held] = 0.0
        baseline = baseline.with_vector(vector)
    bounds = (baseline_bounds(baseline, 0), baseline_bounds(baseline, 1))
    for level in continuation(errors):
        enough = tolerance if level is errors else LIMITS.coarse_tolerance
        start = np.clip(baseline.vector, *bounds)
        begun = _Round(evidence, baseline, bounds, held, level, enough / 10, start)
        solution = minimise_reweighted(begun, rounds=LIMITS.base_fit_reweighted, tolerance=enough, iterations=30)
        baseline = baseline.with_vector(solution.x)
        if solution.cost > LIMITS.base_fit_followed * len(solution.residual):
            break  # what does not follow the data here is led astray by smaller errors
    return BaseFit(baseline, solution, errors.with_log_sizes(level.log_sizes))


@dataclass(frozen=True)
class _Round:
    """A search from some unknowns, with what is held there."""

    evidence: MeasuredData
    start: BaselineParameters
    bounds: tuple[Array, Array]
    held: NDArray[np.int64]
    errors: ErrorModel
    tolerance: float
    x: Array

    def begun_at(self, x: Array) -> Self:
        return replace(self, x=x)

    @cached_property
    def here(self) -> Linearisation:
        """What is held."""
        return residual_model(self.evidence, errors=self.errors).linearisation(self.start.with_vector(self.x))

    def _prior(self, model: ResidualModel | FrequencyModel) -> tuple[Array, Array]:
        mean, precision = model.prior(self.start)
        mean[self.held], precision[self.held, self.held] = 0.0, HELD_PRECISION
        return mean, precision

    def solve(self, *, iterations: int) -> Solution:
        model = residual_model(self.evidence, errors=self.errors, held=self.here)
        mean, precision = self._prior(model)

        def evaluate(x: Array) -> tuple[Array, Array]:
            prediction = model.evaluate(self.start.with_vector(x))
            return prediction.residual, prediction.jacobian

        # Few frequencies may leave a modulus open, which would run off.
        largest = largest_step(self.start.base) if isinstance(model, FrequencyModel) else None
        return minimise(
            evaluate, self.x, mean=mean, precision=precision, iterations=iterations, tolerance=self.tolerance,
            steps=StepRule(bounds=self.bounds, largest=largest),
        )  # fmt: skip

    def cost_at(self, there: Self) -> float:
        model = residual_model(self.evidence, errors=self.errors, held=there.here.weighted_as(self.here))
        mean, precision = self._prior(model)
        r, away = model.evaluate(self.start.with_vector(there.x), sensitivities=False).residual, there.x - mean
        return float(r @ r + away @ precision @ away)
