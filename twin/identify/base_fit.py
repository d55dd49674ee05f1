"""Fit the base family - linear parameters and the joint's law - to all evidence at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.gauss_newton import Solution, minimise
from twin.identify.joint_law import LayerLaw, choose_knots, spline_basis
from twin.identify.linear_fit import base_bounds
from twin.identify.linear_model import BaseParameters, believed_parameters
from twin.identify.prediction import Predictor
from twin.identify.unknowns import LOOSE, TIGHT, Slack, Unknowns

__all__ = ["REWEIGHTED", "fit_base", "law_from_steps", "starting_unknowns", "unknowns_bounds"]

Array = NDArray[Any]

TURNS = 25
"""Newton steps for each step's own softening and loss; eight are usual."""
LARGEST_LOSS = 10.0
"""Loss modulus that is looked for, over E'."""
READ_OFF = 1e-3
"""Relative error of a response within which a step's softening and loss count as found."""
SMOOTHNESS = 0.3
"""Weight of a law's second differences beside the steps' own weights when it is first read off them."""
SOFTENING_OF_A_STEP = (-0.5, 0.98)
"""Least and largest that is looked for, over E'."""
MOST_SOFTENED, MOST_STIFFENED = 0.98, 0.5
"""Shares of E' that a law may take off or add."""
REWEIGHTED = 10
"""Most fits with one slack, each with the weights that the last one's law gives the steps, until they gain nothing."""
TOLERANCE = 0.3
"""Gain of a fit with new weights, in units of the cost per degree of freedom, at which they are left as they are."""
HELD_PRECISION = 1e16
"""Of an unknown that is held: so small an uncertainty moves nothing, and the information stays invertible."""


def starting_unknowns(evidence: Evidence, *, knots: int = 20, extension: Extension | None = None) -> Unknowns:
    """Base parameters of the broadband fit, else what is believed, and a law read off the steps one by one."""
    base = evidence.linear.base if evidence.linear else believed_parameters(evidence.rig, evidence.preload)
    return law_from_steps(Predictor(evidence, extension), base, knots=knots)


def law_from_steps(predictor: Predictor, base: BaseParameters, *, knots: int = 20) -> Unknowns:
    """The laws that reproduce each step's reference channel, smoothed onto knots that follow the layers' own motion.

    For each step by itself one softening and one loss are found that all points share, as parts of their joint's E', by
    Newton's method on the inverse of the response, which near one resonance is almost linear in the moduli: it
    converges from linear joints even where the resonance has moved by many of its widths.  A point counts in what is
    found by its part in the energy, that is by the square of its motion; a step counts in a joint's law as far as the
    response feels that joint.
    """
    evidence = predictor.evidence
    if not len(evidence.steps) or not len(predictor.points):
        nowhere = choose_knots(np.zeros(0), knots)
        return Unknowns(base, (LayerLaw.zero(nowhere, nowhere),) * base.joints)
    steps, time, p = evidence.steps, predictor.step_times, len(predictor.points)
    omega = predictor.clock(steps.omega, time)
    free = predictor.receptance(omega, base, time, inner=False, points=True)
    around = predictor.surroundings(free, omega)
    E = predictor.moduli[0][predictor.points.joint]
    weights = predictor.local.weights * np.concatenate([E, E])
    n = len(predictor.moving)
    s, loss = np.zeros((2, len(omega)))
    for _ in range(TURNS):
        stiffness = np.zeros((len(omega), n), complex)
        stiffness[:, :p], stiffness[:, p : 2 * p] = -s[:, None] * weights[:, :p], 1j * loss[:, None] * weights[:, p:]
        if predictor.local.forces:
            laws = _smoothed(predictor, s, loss, around.motion(stiffness)[0], knots)
            stiffness[:, 2 * p :] = predictor.local.balance(laws, omega, around).stiffness[:, 2 * p :]
        motion, reading, by_stiffness = around.reading(stiffness)
        # d(1/H) H = -dH/H; both unknowns are real, the equation is complex.
        gap = reading * steps.force[:, 0] / around.amplitude - 1
        each = by_stiffness[:, : 2 * p] * weights
        a, b = np.sum(each[:, :p], axis=1), -1j * np.sum(each[:, p:], axis=1)
        determinant = a.real * b.imag - a.imag * b.real
        ds = (gap.real * b.imag - gap.imag * b.real) / determinant
        dl = (a.real * gap.imag - a.imag * gap.real) / determinant
        s = np.clip(s + np.clip(ds, -0.3, 0.3), *SOFTENING_OF_A_STEP)
        loss = np.clip(loss + np.clip(dl, -1.0, 1.0), -0.1 * LARGEST_LOSS, LARGEST_LOSS)
    return Unknowns(base, _smoothed(predictor, s, loss, motion, knots, each, np.abs(gap)))


def _smoothed(
    predictor: Predictor, s: Array, loss: Array, motion: Array, knots: int, by_moduli: Array | None = None,
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
    p, weights, laws = len(predictor.points), predictor.local.weights, []
    for joint, E in enumerate(predictor.moduli[0]):
        own, found = predictor.local.of_joint(joint), []
        for values, at in ((s, own), (loss, p + own)):
            amplitude = np.abs(motion[:, at])
            x = choose_knots(amplitude, knots)
            energy = weights[:, at] * amplitude**2
            B = np.einsum("sp,spk->sk", energy / energy.sum(axis=1, keepdims=True), spline_basis(x, amplitude)[0])
            weight = 1.0 if by_moduli is None else np.abs(np.sum(by_moduli[:, at], axis=1))
            weight = np.broadcast_to(weight, len(values)) * (gap < READ_OFF)
            weight = np.minimum(weight, 3 * np.median(weight))
            weight = weight / (np.max(weight) or 1.0)
            straight = SMOOTHNESS * np.diff(np.eye(knots), 2, axis=0)
            rows = np.vstack([weight[:, None] * B, straight, 1e-3 * np.eye(knots)])
            right = np.concatenate([weight * values, np.zeros(len(rows) - len(values))])
            found.append((x, np.linalg.lstsq(rows, right, rcond=None)[0]))
        (opening, softening), (slip, losing) = found
        softening = np.clip(softening, -MOST_STIFFENED, MOST_SOFTENED)
        laws.append(LayerLaw(opening, slip, E * softening, E * np.maximum(losing, 0.0)))
    return tuple(laws)


def unknowns_bounds(unknowns: Unknowns, side: int) -> Array:
    """Lower (0) or upper (1) limits of the unknowns' vector: a layer gives no energy away, and keeps some stiffness."""
    softening, loss = ((-MOST_STIFFENED, 0.0), (MOST_SOFTENED, np.inf))[side]
    bounds = np.empty(len(unknowns.blocks))
    bounds[: unknowns.of_laws.start] = base_bounds(unknowns.base.joints)[side]
    for joint, E in enumerate(unknowns.base.E):
        bounds[unknowns.softening(joint)], bounds[unknowns.loss(joint)] = softening * E, loss
    return bounds


def fit_base(
    evidence: Evidence,
    *,
    start: Unknowns | None = None,
    slacks: Sequence[Slack] = (LOOSE, TIGHT),
    iterations: int = 30,
    held_at_zero: Sequence[int] = (),
) -> tuple[Unknowns, Solution]:
    """Fit base parameters and law.

    Parameters
    ----------
    start
        Where to begin; read off the evidence by default.
    slacks
        How much the model may be wrong, one fit after the other.
    held_at_zero
        Places in the unknowns' vector that are not free.
    """
    unknowns = start or starting_unknowns(evidence)
    held = np.asarray(held_at_zero, int)
    if len(held):
        vector = unknowns.vector
        vector[held] = 0.0
        unknowns = unknowns.with_vector(vector)
    for slack in slacks:
        # With slack the weights hardly depend on the law.
        for _ in range(REWEIGHTED if slack is TIGHT else 1):
            here = Predictor(evidence, slack=slack).linearisation(unknowns)
            predictor = Predictor(evidence, slack=slack, held=here)
            mean, precision = predictor.prior(unknowns)
            mean[held], precision[held, held] = 0.0, HELD_PRECISION

            def evaluate(
                x: Array, predictor: Predictor = predictor, unknowns: Unknowns = unknowns
            ) -> tuple[Array, Array]:
                prediction = predictor.evaluate(unknowns.with_vector(x))
                return prediction.residual, prediction.jacobian

            bounds = (unknowns_bounds(unknowns, 0), unknowns_bounds(unknowns, 1))
            solution = minimise(
                evaluate, unknowns.vector, mean=mean, precision=precision, bounds=bounds, iterations=iterations
            )
            unknowns = unknowns.with_vector(solution.x)
            if solution.gained_little(TOLERANCE):
                break
    return unknowns, solution
