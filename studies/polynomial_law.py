"""The papers' law: E' = E'0 - g1(X), G' = G'0 + j g2(X) with polynomials g1, g2 of the response amplitude X.

Each step of a stepped sine is linear at its own measured amplitude, so the coefficients follow from the logarithm of
its frequency response by Gauss-Newton: [S]{dphi} = {eps}, S from products of receptances (2011 paper, equations 13 to
16; the complex logarithm, whose real part is the paper's dB and whose imaginary part is the phase), every iteration
regularised with the strength at the L-curve's corner (equation 17).  The linear parameters come from other data; what
they may be wrong by counts as noise (:mod:`studies.uncertain_base`), and so does what a function of one amplitude
is wrong by anyway, which near a steep flank is many times the sensors' noise.  X is scaled by (omega / omega_1)^2, for
the joint's load follows the inertia outboard of it, and by what the layer itself does at each step
(:mod:`studies.layer_motion`).  Such a law holds about one resonance; what holds in all is in
:mod:`twin.identify.nonlinear.joint_law`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.layer_motion import LayerMotion, layer_motion
from studies.layer_response import LayerResponse, layer_response
from studies.uncertain_base import UncertainBase
from twin.identify.l_curve import LCurve, decompose
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.nonlinear.joint_law import spline_basis
from twin.identify.polynomials import Iteration, PolynomialFit
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.rms import relative_error_percent

__all__ = ["LARGEST_ORDER", "PolynomialProblem", "fit_polynomials"]

Array = NDArray[Any]

LAW_ERROR = 1e-3
"""Relative error of a law at a step, since it is a function of one amplitude and the layer's strains are a field."""

LARGEST_ORDER = 4
ITERATIONS, TOLERANCE = 40, 1e-7
READ_OFF_KNOTS = 20
WEAKER = 0.1
"""Factor on the strength where the corner's step gains nothing any more: what it held back then comes in."""


@dataclass(frozen=True)
class PolynomialProblem:
    """Steps to be explained by polynomials.

    Attributes
    ----------
    layer : LayerResponse
        At the steps' frequencies, with what the extension adds.
    amplitude_m : ndarray, (s,)
        X of each step.
    measured : ndarray, (s,)
        Response per force of the reference channel.
    reference : int
        Its place among the outputs.
    base : LinearParameters
    base_covariance : ndarray
        Of ``base.vector``.
    by_base : ndarray, (s, b)
        Sensitivity of the logarithm to ``base.vector``.
    guess : tuple of ndarray, (s,)
        Softening and loss read off step by step, to begin from.
    motion : LayerMotion
        What the layer does at each step: g1 goes by its opening, g2 by its slip.
    left : ndarray, (s,)
        Share of E', and so of g1, that a known drift has left.
    """

    layer: LayerResponse
    amplitude_m: Array
    measured: Array
    reference: int
    base: LinearParameters
    base_covariance: Array
    by_base: Array
    guess: tuple[Array, Array]
    motion: LayerMotion
    left: Array

    @staticmethod
    def of(residual_model: ResidualModel, base: LinearParameters, base_covariance: Array) -> PolynomialProblem:
        """All steps of the residual model's evidence, which are about one resonance."""
        evidence = residual_model.evidence
        steps, ref = evidence.steps, evidence.reference

        def layer_at(commanded: Array) -> LayerResponse:
            layer = layer_response(residual_model, base, commanded, steps.time_s - evidence.origin_s)
            if not residual_model.modification.nonlinear:
                return layer
            ports = residual_model.nonlinear_ports
            amplitude = np.abs(layer.R[:, ports, residual_model.model.ports.drive] * steps.force[:, :1])
            return layer.with_stiffness(ports, residual_model.local.equivalent(amplitude, layer.omega))

        X = steps.amplitude_m * (steps.omega / evidence.reference_omega) ** 2
        left = residual_model.normal_left(residual_model.step_times)[:, 0]
        measured = steps.response[:, ref, 0] / steps.force[:, 0]
        layer = layer_at(steps.omega)
        guess = _read_off(layer, measured, X, left, ref)
        R = layer.with_moduli(-guess[0] * left + 0j, 1j * guess[1])
        H = residual_model.model.response(R, layer.omega)[:, ref, None]
        by_base = residual_model.model.sensitivity(R, layer.omega, base)[:, ref] / H
        motion = layer_motion(layer, layer_at, steps.omega, -guess[0] * left + 0j, 1j * guess[1], output=ref)
        return PolynomialProblem(layer, X, measured, ref, base, base_covariance, by_base, guess, motion, left)

    def select(self, keep: Array) -> PolynomialProblem:
        """The steps where `keep` is true."""
        rows = np.flatnonzero(keep)
        return PolynomialProblem(
            self.layer.pick(rows), self.amplitude_m[rows], self.measured[rows], self.reference, self.base,
            self.base_covariance, self.by_base[rows], (self.guess[0][rows], self.guess[1][rows]),
            self.motion.pick(rows), self.left[rows],
        )  # fmt: skip

    def evaluate(self, softening: Array, loss: Array) -> tuple[Array, Array, Array]:
        """Predicted response per force (s,), and the logarithm's sensitivities to g1 and g2 at each step (s,)."""
        H, by_E, by_G = self.layer.responses(-softening * self.left + 0j, 1j * loss)
        return H[:, self.reference], -by_E[:, self.reference] * self.left, 1j * by_G[:, self.reference]

    def response(self, fit: PolynomialFit, amplitude_m: Array) -> Array:
        """Response per force (s,) by an identified law, with the moduli at given amplitudes (s,) of the sensor."""
        opening_m, slip_m = amplitude_m * self.motion.opening, amplitude_m * self.motion.slip
        H = self.evaluate(fit.softening_at(opening_m), fit.loss_at(slip_m))[0]
        return np.asarray(H * np.exp(self.by_base @ fit.base_change))

    def law_factors(self, variance: float, sensitivities: tuple[Array, Array]) -> Array:
        """Factors (s, 2, 2) that whiten scatter and the law's own error at each step to a scatter of this variance.

        With the logarithm's sensitivities to g1 and g2 (s,) at the guess.
        """
        factors = np.broadcast_to(np.eye(2), (len(self.measured), 2, 2))
        if not 0 < variance < np.inf:
            return factors
        covariance = variance * factors
        for S, law in zip(sensitivities, self.guess, strict=True):
            error = LAW_ERROR * np.stack([(S * law).real, (S * law).imag], axis=1)
            covariance = covariance + error[:, :, None] * error[:, None, :]
        return np.asarray(np.sqrt(variance) * np.linalg.inv(np.linalg.cholesky(covariance)))


def _read_off(layer: LayerResponse, measured: Array, X: Array, left: Array, reference: int) -> tuple[Array, Array]:
    """Softening and loss (s,) that reproduce each step, smoothed over amplitude.

    Newton's method on the inverse of the response, as in :func:`twin.identify.base_fit.law_from_steps`.
    """
    E = layer.residual_model.moduli[0][0]
    s, loss = np.zeros((2, len(X)))
    for _ in range(12):
        H, by_E, by_G = layer.responses(-left * s + 0j, 1j * loss)
        gap = H[:, reference] / measured - 1
        a, b = by_E[:, reference] * left, -1j * by_G[:, reference]
        determinant = a.real * b.imag - a.imag * b.real
        ds = (gap.real * b.imag - gap.imag * b.real) / determinant
        dl = (a.real * gap.imag - a.imag * gap.real) / determinant
        s = np.clip(s + np.clip(ds, -0.3 * E, 0.3 * E), -0.5 * E, 0.95 * E)
        loss = np.clip(loss + np.clip(dl, -E, E), -E, 10 * E)
    knots = np.linspace(np.sqrt(np.min(X)), np.sqrt(np.max(X)), READ_OFF_KNOTS) ** 2
    B = spline_basis(knots, X)[0]
    weight = np.minimum(1.0, np.abs(a))[:, None] + 1e-3
    ridge = 1e-3 * np.max(weight) * np.diff(np.eye(READ_OFF_KNOTS), 2, axis=0)
    rows = np.vstack([weight * B, ridge])
    right = np.stack([np.append(weight[:, 0] * values, np.zeros(len(ridge))) for values in (s, loss)], axis=1)
    smooth = B @ np.linalg.lstsq(rows, right, rcond=None)[0]
    return smooth[:, 0], smooth[:, 1]


def fit_polynomials(
    problem: PolynomialProblem, *, orders: tuple[int, int] | None = None, largest_order: int = LARGEST_ORDER
) -> PolynomialFit:
    """Identify g1 and g2.

    Parameters
    ----------
    orders
        Of g1 and g2; by default each from 1 to `largest_order` as Schwarz's criterion chooses.

    Raises
    ------
    ValueError
        If there are fewer steps than coefficients.
    """
    most = (len(problem.measured) - 2) // 2
    if orders is not None:
        if sum(orders) + 2 > 2 * len(problem.measured) - 1:
            raise ValueError(f"{len(problem.measured)} steps cannot determine polynomials of orders {orders}")
        return _fit(problem, orders, _fit(problem, orders).variance)
    if most < 1:
        raise ValueError(f"{len(problem.measured)} steps are too few for polynomials of any order")
    highest = min(largest_order, most)
    scatter = _fit(problem, (highest, highest)).variance
    pairs = product(range(1, highest + 1), repeat=2)
    return min((_fit(problem, pair, scatter) for pair in pairs), key=lambda fit: fit.bic)


def _fit(problem: PolynomialProblem, orders: Sequence[int], scatter: float = np.inf) -> PolynomialFit:
    """Fit on residuals whose noise has the variance `scatter`; without one the base parameters are taken as exact."""
    H, S1, S2 = problem.evaluate(*problem.guess)
    factors = problem.law_factors(scatter, (S1, S2))
    uncertain = UncertainBase.of(_by_step(factors, problem.by_base), problem.base_covariance, scatter)
    span = float(np.max(problem.amplitude_m))
    share = problem.amplitude_m / span
    powers = [
        (share * moved)[:, None] ** np.arange(order + 1)
        for moved, order in zip((problem.motion.opening, problem.motion.slip), orders, strict=True)
    ]
    first = orders[0] + 1
    # Constants to begin with, so that the iterations show how the functions of amplitude come about.
    starts = [np.zeros(order + 1) for order in orders]
    for start, guess, sensitivity in zip(starts, problem.guess, (S1, S2), strict=True):
        start[0] = np.average(guess, weights=np.abs(sensitivity) ** 2)
    # In units in which both functions move the response alike: a g2 must be many times a g1 to matter.
    units = 1 / np.array([np.linalg.norm(S1), np.linalg.norm(S2)])
    units *= np.sqrt(len(H))
    scale = np.concatenate([np.full(first, units[0]), np.full(orders[1] + 1, units[1])])
    x = np.concatenate(starts) / scale

    def plain(x: Array) -> tuple[Array, Array]:
        a = x * scale
        H, S1, S2 = problem.evaluate(powers[0] @ a[:first], powers[1] @ a[first:])
        return np.log(problem.measured / H), np.hstack([S1[:, None] * powers[0], S2[:, None] * powers[1]]) * scale

    def evaluate(x: Array) -> tuple[Array, Array]:
        eps, S = (_by_step(factors, part) for part in plain(x))
        return uncertain.whiten(eps[:, 0]), uncertain.whiten(S)

    physical = scale / span ** np.concatenate([np.arange(first), np.arange(orders[1] + 1)])

    def entry(x: Array, eps: Array, strength: float) -> Iteration:
        a = x * physical
        return Iteration(float(np.linalg.norm(eps)), a[:first], a[first:], strength)

    eps, S = evaluate(x)
    history = [entry(x, eps, 0.0)]
    curve = None
    for _ in range(ITERATIONS):
        problem_k = decompose(S, eps)
        l_curve = problem_k.l_curve()
        curve = curve or l_curve
        taken = None
        for strength in _strengths(l_curve):
            trial = x + problem_k.solve(strength)
            eps_trial, S_trial = evaluate(trial)
            gain = eps @ eps - eps_trial @ eps_trial
            if np.isfinite(gain) and gain > TOLERANCE * (eps @ eps):
                taken = strength
                break
        if taken is None:
            break
        x, eps, S = trial, eps_trial, S_trial
        history.append(entry(x, eps, taken))
    assert curve is not None
    rows, count = len(eps), len(x)
    a, inverse = x * physical, np.linalg.pinv(S) * physical[:, None]
    variance = float(eps @ eps) / max(1, rows - count)
    missed = plain(x)[0]
    base_change = uncertain.change(_by_step(factors, missed)[:, 0])
    left = missed - problem.by_base @ base_change
    return PolynomialFit(
        softening=a[:first], loss=a[first:], covariance=variance * inverse @ inverse.T,
        base_change=base_change, variance=variance,
        bic=float(rows * np.log(eps @ eps / rows) + count * np.log(rows)), largest_amplitude_m=span,
        residual_percent=relative_error_percent(np.exp(-left), np.ones(len(left))),
        l_curve=curve, history=tuple(history),
    )  # fmt: skip


def _by_step(factors: Array, values: Array) -> Array:
    """Real parts of (s,) or (s, n) above imaginary ones, (2 s, n), each step's two times its factor (2, 2)."""
    columns = values.reshape(len(values), -1)
    whitened = np.einsum("sij,jsn->isn", factors, np.stack([columns.real, columns.imag]))
    return np.asarray(whitened.reshape(2 * len(columns), -1))


def _strengths(curve: LCurve) -> list[float]:
    """Strengths to try: the corner's, weaker ones where it holds everything back, stronger ones where it overshoots."""
    corner = curve.corner
    weaker = [corner * WEAKER, corner * WEAKER**2, 0.0]
    stronger = [float(s) for s in curve.strength[curve.strength > corner][::40]]
    return [corner, *weaker, *stronger]
