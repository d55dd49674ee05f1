"""The papers' polynomials by level of excitation: each by itself, all together, and each predicted from the others.

A law of the joint's own should not depend on the force that it was measured at.  Whether it does shows in two figures:
how much worse one law for all levels is than a law for each, and how a level comes out that the law has not seen.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from studies.polynomial_law import PolynomialProblem, fit_polynomials
from twin.identify.base_fit import fit_base
from twin.identify.identified import Identified
from twin.identify.limits import LIMITS
from twin.identify.linear.linear_model import LinearParameters
from twin.identify.measured_data import MeasuredData
from twin.identify.polynomials import LeftOut, PolynomialFit, Polynomials
from twin.identify.residuals.residual_model import ResidualModel
from twin.identify.rms import relative_error_percent
from twin.identify.spectra.resonances import by_resonance
from twin.identify.spectra.sweeps import rows_by_sweep

__all__ = ["polynomials_by_level", "predict_left_out", "with_polynomials"]

Array = NDArray[Any]

FEWEST_STEPS = 4


def with_polynomials(
    found: Identified, evidence: MeasuredData, *, report: Callable[[str], None] = lambda text: None
) -> Identified:
    """What was identified with the papers' polynomials beside it, where there are sweeps and one joint.

    The linear parameters come from the broadband runs alone, where there are any.
    """
    if not len(evidence.steps) or len(evidence.rig.joints) != 1:
        return found
    base = (found.baseline.base, found.solution.covariance)
    if evidence.broadband:
        report("fitting the broadband runs alone")
        linear = fit_base(evidence.without_steps())
        base = (linear.baseline.base, linear.solution.covariance)
    report("identifying the papers' polynomials")
    polynomials = polynomials_by_level(ResidualModel(evidence), *base)
    warnings = found.warnings
    if polynomials is not None and polynomials.together.residual_percent > LIMITS.poor_polynomial_percent:
        fit = polynomials.together
        warnings += (
            f"polynomials of orders {fit.orders[0]} and {fit.orders[1]} leave {fit.residual_percent:.2g} % of all "
            "levels together; the model file has splines",
        )
    return replace(found, polynomials=polynomials, warnings=warnings)


def polynomials_by_level(
    residual_model: ResidualModel, base: LinearParameters, covariance: Array
) -> Polynomials | None:
    """Polynomials on top of given linear parameters; None where the steps are too few.

    Parameters
    ----------
    residual_model
        Of evidence with sweeps; those about the lowest resonance are taken, for a law of one sensor's amplitude holds
        about one.
    base, covariance
        Linear parameters, and the covariance of their vector (in its first rows and columns).
    """
    n = len(base.vector)
    lowest = by_resonance(residual_model.evidence.steps.omega)[0]
    if len(lowest) < len(residual_model.evidence.steps):
        about = np.isin(np.arange(len(residual_model.evidence.steps)), lowest)
        steps = residual_model.evidence.steps.select(about)
        residual_model = ResidualModel(replace(residual_model.evidence, steps=steps))
    evidence = residual_model.evidence
    if len(np.unique(evidence.steps.amplitude_m)) < 2:
        return None
    problem = PolynomialProblem.of(residual_model, base, covariance[:n, :n])
    states = evidence.steps.states
    names = np.array([f"{state.target_channel} {state.target_amplitude:g}" for state in states])
    try:
        together = fit_polynomials(problem)
    except ValueError:
        return None
    counted = [name for name in dict.fromkeys(names.tolist()) if np.sum(names == name) >= FEWEST_STEPS]
    levels = {name: fit_polynomials(problem.select(names == name)) for name in counted}
    residual = {}
    for sweep, rows in rows_by_sweep(states).items():
        X = problem.amplitude_m[rows]
        fits = {"together": together, **({"level": levels[names[rows[0]]]} if names[rows[0]] in levels else {})}
        piece = problem.select(np.isin(np.arange(len(names)), rows))
        residual[sweep] = {
            key: relative_error_percent(piece.response(fit, X), piece.measured) for key, fit in fits.items()
        }
    left_out = {name: predict_left_out(problem, names == name) for name in counted} if len(counted) > 1 else {}
    return Polynomials(levels=levels, together=together, residual_percent=residual, left_out=left_out, base=base)


def predict_left_out(problem: PolynomialProblem, left_out: Array) -> LeftOut:
    """Identify a law from the steps outside `left_out` and predict those inside."""
    fit, piece = fit_polynomials(problem.select(~left_out)), problem.select(left_out)
    X = piece.amplitude_m
    held = piece.response(fit, X)
    forced, found = _at_force(piece, fit)
    return LeftOut(
        at_amplitude_percent=relative_error_percent(held, piece.measured),
        at_force_percent=relative_error_percent(forced[found], piece.measured[found]) if found.any() else float("nan"),
        lost=int(np.sum(~found)),
        extrapolated=bool(X.max() > fit.largest_amplitude_m),
    )


def _at_force(piece: PolynomialProblem, fit: PolynomialFit) -> tuple[Array, Array]:
    """Responses (s,) at each step's force, on the branch of the measured one, and whether there is such a state.

    The amplitude is the response's own: log X = log |H(X)| + what the force makes of it, by Newton from the measured X.
    """

    def response(x: Array) -> Array:
        return piece.response(fit, np.exp(x))

    def miss(x: Array) -> Array:
        return np.log(np.abs(response(x))) + from_force - x

    from_force = np.log(piece.amplitude_m / np.abs(piece.measured))
    x = np.log(piece.amplitude_m)
    for _ in range(60):
        g = miss(x)
        slope = (miss(x + 1e-5) - miss(x - 1e-5)) / 2e-5
        if np.max(np.abs(g)) < 1e-9:
            break
        x = x - np.clip(g / slope, -0.05, 0.05)
    # Beyond a fold there is nothing to converge to.
    return response(x), np.abs(miss(x)) < 1e-6
