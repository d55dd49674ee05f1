"""Fit the base family - linear parameters and the joint's law - to all evidence at once."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.evidence import Evidence
from twin.identify.extension import Extension
from twin.identify.gauss_newton import Solution, minimise
from twin.identify.joint_law import SplineLaw, choose_knots
from twin.identify.linear_fit import base_bounds
from twin.identify.linear_model import believed_parameters
from twin.identify.prediction import Predictor
from twin.identify.unknowns import LOOSE, TIGHT, Slack, Unknowns

__all__ = ["fit_base", "starting_unknowns", "stepwise_law", "unknowns_bounds"]

Array = NDArray[Any]

REWEIGHTED = 2
"""Fits with each slack, each with the weights that the last one's law gives the steps."""
HELD_PRECISION = 1e16
"""Of an unknown that is held: so small an uncertainty moves nothing, and the information stays invertible."""


def starting_unknowns(evidence: Evidence, *, knots: int = 20, extension: Extension | None = None) -> Unknowns:
    """Base parameters of the broadband fit, else what is believed, and a law read off the steps one by one."""
    base = evidence.linear.base if evidence.linear else believed_parameters(evidence.rig, evidence.preload)
    law = SplineLaw.zero(choose_knots(evidence.steps.amplitude_m, knots))
    unknowns = Unknowns(base, law)
    return stepwise_law(Predictor(evidence, extension), unknowns) if len(evidence.steps) else unknowns


def stepwise_law(predictor: Predictor, unknowns: Unknowns) -> Unknowns:
    """The law that reproduces each step's reference channel, smoothed onto the knots.

    Newton's method on the inverse of the response, which near one resonance is almost linear in the layer's moduli,
    so that it converges from a linear joint even where the resonance has moved by many of its widths.
    """
    evidence = predictor.evidence
    steps = evidence.steps
    omega, X = steps.omega, predictor.amplitude_m
    time = steps.time_s - evidence.origin_s
    measured = steps.response[:, evidence.reference, 0] / steps.force[:, 0]
    s, loss, left = np.zeros(len(omega)), np.zeros(len(omega)), predictor.normal_left(time)
    zero = Unknowns(unknowns.base, SplineLaw.zero(unknowns.law.knots))
    dE0, dG0 = predictor.moduli_changes(zero, X, time)
    port, drive = predictor.model.ports.outputs.start + evidence.reference, predictor.model.ports.drive
    p, E = predictor.model.ports, predictor.moduli[0]
    largest_loss = 5 * E / predictor.shear_share
    for _ in range(8):
        R = predictor.receptance(omega, unknowns.base, dE0 - left * s, dG0 + 1j * loss)
        R = predictor.with_nonlinear(R, omega)
        H = predictor.responses(R, omega)[:, evidence.reference]
        receptance = R[:, port, drive]
        SE = -np.sum(R[:, port, p.normal] * R[:, p.normal, drive], axis=1) * left
        SG = -np.sum(R[:, port, p.shear] * R[:, p.shear, drive], axis=1)
        # d(1/H)/H^-1 = -dH/H; both unknowns are real, the equation is complex.
        gap = H / measured - 1
        a, b = SE / receptance, -1j * SG / receptance
        determinant = a.real * b.imag - a.imag * b.real
        ds = (gap.real * b.imag - gap.imag * b.real) / determinant
        dl = (a.real * gap.imag - a.imag * gap.real) / determinant
        s = np.clip(s + np.clip(ds, -0.3 * E, 0.3 * E), -0.5 * E, 0.95 * E)
        loss = np.clip(loss + dl, -0.1 * largest_loss, largest_loss)
    B = unknowns.law.basis(X)
    weight = np.minimum(1.0, np.abs(a))[:, None] + 1e-3
    k = len(unknowns.law.knots)
    ridge = 1e-3 * np.diff(np.eye(k), 2, axis=0) if k > 2 else np.zeros((0, k))

    def smooth(values: Array, B: Array) -> Array:
        rows = np.vstack([weight * B, ridge * np.max(weight)])
        return np.linalg.lstsq(rows, np.concatenate([weight[:, 0] * values, np.zeros(len(ridge))]), rcond=None)[0]

    law = SplineLaw(unknowns.law.knots, smooth(s, unknowns.law.basis(X / left)), smooth(loss, B))
    return Unknowns(unknowns.base, law)


def unknowns_bounds(unknowns: Unknowns, side: int) -> Array:
    """Lower (0) or upper (1) limits of the unknowns' vector; the law is free."""
    rest = np.full(len(unknowns.vector) - len(unknowns.base.vector), -np.inf if side == 0 else np.inf)
    return np.concatenate([base_bounds()[side], rest])


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
    # With slack the weights hardly depend on the law.
    for slack in (each for each in slacks for _ in range(REWEIGHTED if each is TIGHT else 1)):
        factor = Predictor(evidence, slack=slack).step_factor(unknowns)
        predictor = Predictor(evidence, slack=slack, step_factor=factor)
        mean, precision = predictor.prior(unknowns)
        mean[held], precision[held, held] = 0.0, HELD_PRECISION

        def evaluate(x: Array, predictor: Predictor = predictor, unknowns: Unknowns = unknowns) -> tuple[Array, Array]:
            prediction = predictor.evaluate(unknowns.with_vector(x))
            return prediction.residual, prediction.jacobian

        bounds = (unknowns_bounds(unknowns, 0), unknowns_bounds(unknowns, 1))
        solution = minimise(
            evaluate, unknowns.vector, mean=mean, precision=precision, bounds=bounds, iterations=iterations
        )
        unknowns = unknowns.with_vector(solution.x)
    return unknowns, solution
