"""Base parameters from a broadband run: Gauss-Newton on whitened frequency responses."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve_triangular

from twin.identify.broadband import BinnedResponse, bin_response, find_resonances
from twin.identify.linear_model import DAMPED_MODES, BaseParameters, LinearModel
from twin.identify.spectrum import BroadbandRecord

DETUNING_STD = 1e-4
"""Prior of what the finite elements and rounded dimensions leave wrong in a natural frequency."""

__all__ = ["LinearFit", "base_prior", "fit_linear", "reduce_broadband", "whiten"]

Complex = NDArray[Any]
Real = NDArray[Any]


@dataclass(frozen=True, kw_only=True)
class LinearFit:
    """Base parameters with covariance (of ``base.vector``), and how well they fit.

    Attributes
    ----------
    chi2_per_dof : float
        Of the whitened residual.
    history : tuple of float
        Cost at each iteration.
    """

    base: BaseParameters
    covariance: Real
    chi2_per_dof: float
    history: tuple[float, ...]


def base_prior(believed: BaseParameters) -> tuple[Real, Real]:
    """Mean and standard deviation of ``base.vector`` before any data: what an experimenter may be wrong about."""
    mean = believed.vector
    std = np.concatenate([[0.3, 0.3, 0.05, 0.3], np.full(DAMPED_MODES, 1.0), np.full(DAMPED_MODES, DETUNING_STD)])
    return mean, std


def whiten(covariance: Complex, values: Complex) -> Complex:
    """Multiply by the inverse Cholesky factors: (b, o, o) and (b, o) or (b, o, k)."""
    L = np.linalg.cholesky(covariance)
    if values.ndim == 2:
        return np.linalg.solve(L, values[:, :, None])[:, :, 0]
    return np.linalg.solve(L, values)


def fit_linear(
    model: LinearModel, data: BinnedResponse, start: BaseParameters, *, believed: BaseParameters, iterations: int = 15
) -> LinearFit:
    """Fit the base parameters to a binned response.

    Parameters
    ----------
    start
        Where to begin.
    believed
        Centre of the prior.
    """
    mean, std = base_prior(believed)
    vector, omega = start.vector, data.omega
    damping = 1e-3
    history: list[float] = []

    def evaluate(vector: Real) -> tuple[Real, Real, float]:
        base = BaseParameters.from_vector(vector)
        R = model.receptance(omega, base)
        r = whiten(data.covariance, data.H - model.response(R, omega)).ravel()
        J = whiten(data.covariance, model.sensitivity(R, omega, base)).reshape(len(r), -1)
        residual = np.concatenate([r.real, r.imag]) * np.sqrt(2)
        jacobian = np.concatenate([J.real, J.imag]) * np.sqrt(2)
        cost = float(residual @ residual + np.sum(((vector - mean) / std) ** 2))
        return residual, jacobian, cost

    residual, J, cost = evaluate(vector)
    for _ in range(iterations):
        history.append(cost)
        A = J.T @ J + np.diag(1 / std**2)
        g = J.T @ residual - (vector - mean) / std**2
        improved = False
        for _trial in range(8):
            step = np.linalg.solve(A + damping * np.diag(np.diag(A)), g)
            step *= min(1.0, 0.5 / np.max(np.abs(step)))
            trial = vector + step
            trial_residual, trial_J, trial_cost = evaluate(trial)
            if trial_cost < cost:
                improved = True
                break
            damping *= 10
        if not improved:
            break
        gain = cost - trial_cost
        vector, residual, J, cost = trial, trial_residual, trial_J, trial_cost
        damping = max(damping / 10, 1e-12)
        if gain < 1e-4 * (1 + cost / len(residual)):
            break
    history.append(cost)
    A = J.T @ J + np.diag(1 / std**2)
    return LinearFit(
        base=BaseParameters.from_vector(vector),
        covariance=np.linalg.inv(A),
        chi2_per_dof=float(residual @ residual / max(1, len(residual) - len(vector))),
        history=tuple(history),
    )


def reduce_broadband(
    model: LinearModel, record: BroadbandRecord, believed: BaseParameters, *, force: str, rounds: int = 3
) -> tuple[BinnedResponse, LinearFit]:
    """Bin a broadband record and fit the base parameters to it, each round with a better reference.

    The first reference is what is believed; since bins assume only that the difference to it is smooth away from the
    resonances that the data show, a wrong belief costs accuracy, which the following rounds give back.
    """
    channels = tuple(output.channel for output in model.outputs)
    resonances, band = find_resonances(record, force=force, channels=channels)
    base = believed
    for _ in range(rounds):
        reference, poles_omega, zeta = _reference(model, base)
        inside = poles_omega < 2 * np.pi * 1.3 * band[1]
        poles = (-zeta + 1j) * poles_omega
        data = bin_response(
            record,
            force=force,
            channels=channels,
            reference=reference,
            poles=poles[inside],
            resonances_Hz=np.concatenate([resonances, poles_omega[inside] / (2 * np.pi)]),
            band_Hz=band,
        )
        fit = fit_linear(model, data, base, believed=believed)
        base = fit.base
    return data, fit


def _complex_modes(model: LinearModel, base: BaseParameters) -> tuple[Complex, Complex]:
    """Squares of the complex frequencies, with joint loss, and shapes with Phi' M Phi = 1, (n,) and (n, n)."""
    s = model.structure
    K = s.K0 + base.E * (1 + 1j * base.loss_E) * s.KE + base.G * (1 + 1j * base.loss_G) * s.KG
    inverse = solve_triangular(np.linalg.cholesky(s.M), np.eye(len(s.M)), lower=True)
    values, vectors = np.linalg.eig(inverse @ K @ inverse.T)
    order = np.argsort(values.real)
    vectors = vectors[:, order]
    return values[order], inverse.T @ (vectors / np.sqrt(np.sum(vectors**2, axis=0)))


def _reference(model: LinearModel, base: BaseParameters) -> tuple[Callable[[Real], Complex], Real, Real]:
    """A fast response function, and its natural frequencies and damping ratios.

    Tens of thousands of lines want a sum over complex modes instead of a solution at each; the modal damping acts on
    the complex modes then, a difference far below what a bin leaves free.
    """
    values, Phi = _complex_modes(model, base)
    omega_r = np.sqrt(values.real)
    zeta = np.concatenate([base.zeta, model.basis.zeta])[: len(values)]
    zeta = np.concatenate([zeta, np.full(len(values) - len(zeta), zeta[-1])])
    residues = (model.ports.rows[model.ports.outputs] @ Phi) * (model.ports.rows[model.ports.drive] @ Phi)
    kept = 40

    def response(omega: Real) -> Complex:
        w = omega[:, None]
        D = 1.0 / (values[:kept] - w**2 + 2j * zeta[:kept] * omega_r[:kept] * w)
        static = np.sum(residues[:, kept:] / values[kept:], axis=1)
        return (D @ residues[:, :kept].T + static) * model.to_quantity(omega)

    return response, omega_r, zeta + values.imag / (2 * values.real)
