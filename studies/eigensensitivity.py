"""Parameters from natural frequencies: eigensensitivity update, weighted, in log-parameters.

Minimised is ``sum ((ln f_measured - ln f_model) / (std / f_measured))^2`` plus log-normal priors where given.  The
logarithms keep parameters positive and make a relative error of a high mode count like one of a low mode.
Sensitivities are analytic: for mass-normalised shapes, d(omega^2)/dp = phi' (dK/dp - omega^2 dM/dp) phi.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from twin.structure.modes import counted_modes

__all__ = [
    "FrequencySet",
    "FrequencyUpdate",
    "Iteration",
    "Parameter",
    "Pencil",
    "model_frequencies",
    "pair_modes",
    "update_from_starts",
    "update_parameters",
]

Matrix = NDArray[np.float64]


@dataclass(frozen=True)
class Pencil:
    """Mass and stiffness (n, n) at some parameter values, and their derivatives by the parameters' names.

    `transverse` marks the degrees of freedom (n of them, bool) that move across the beam.
    """

    M: Matrix
    K: Matrix
    transverse: NDArray[np.bool_]
    dM: Mapping[str, Matrix] = field(default_factory=dict)
    dK: Mapping[str, Matrix] = field(default_factory=dict)


@dataclass(frozen=True)
class FrequencySet:
    """Natural frequencies measured in one condition.

    Attributes
    ----------
    name
        Of the condition, such as a preload.
    frequency_Hz, std_Hz : ndarray, (m,)
        Measured values and their standard deviations.
    pencil
        From parameter values to the model's matrices in this condition.
    number : ndarray of int, (m,) or None
        Which bending mode each frequency is, from 1; None counts from the first without a gap.
    shape_rows : ndarray, (s, n) or None
        Rows that read the measured degrees of freedom off a model vector.
    shapes : ndarray, (s, m) or None
        Measured mode shapes there; with them, modes are paired by MAC instead of by number.
    """

    name: str
    frequency_Hz: Matrix
    std_Hz: Matrix
    pencil: Callable[[Mapping[str, float]], Pencil]
    number: NDArray[np.int64] | None = None
    shape_rows: Matrix | None = None
    shapes: Matrix | None = None

    @property
    def numbers(self) -> NDArray[np.int64]:
        """Bending mode numbers, from 1."""
        return np.arange(1, len(self.frequency_Hz) + 1) if self.number is None else self.number


@dataclass(frozen=True)
class Parameter:
    """A positive free parameter: start, bounds, and a log-normal prior about `start` if its width is finite."""

    name: str
    start: float
    prior_log_std: float = np.inf
    lower: float = 1e-300
    upper: float = 1e300


@dataclass(frozen=True)
class Iteration:
    """One accepted step: the objective and the parameters there."""

    objective: float
    values: dict[str, float]


@dataclass(frozen=True)
class FrequencyUpdate:
    """Result of an update.

    Attributes
    ----------
    values, std : dict
        Parameters and standard deviations (first order, of the stated noise), in their own units.
    names : tuple of str
        Order of the parameters in `covariance` and `directions`.
    covariance : ndarray, (k, k)
        Of the parameters' logarithms, from the stated noise and priors.
    residual_factor : float
        Root of chi-square per degree of freedom: multiply standard deviations by it to have them from the residuals
        instead of from the stated noise.  NaN without degrees of freedom.
    singular_values, directions : ndarray, (k,), (k, k)
        Of the weighted sensitivity of the frequencies alone (no priors); column i of `directions` is what singular
        value i determines, to a relative standard deviation of 1 / singular value.
    history : tuple of Iteration
        Accepted steps, the first being the start.
    measured, before, after : dict of ndarray
        Frequencies in Hz by condition: as measured, at the start, at the end.
    chi2, dof
        Misfit of the frequencies in units of their noise, and frequencies minus free parameters.
    converged : bool
        Whether the search stopped by itself.
    """

    values: dict[str, float]
    std: dict[str, float]
    names: tuple[str, ...]
    covariance: Matrix
    residual_factor: float
    singular_values: Matrix
    directions: Matrix
    history: tuple[Iteration, ...]
    measured: dict[str, Matrix]
    before: dict[str, Matrix]
    after: dict[str, Matrix]
    chi2: float
    objective: float
    dof: int
    converged: bool

    @property
    def error_percent(self) -> dict[str, Matrix]:
        """100 (measured - model) / measured by condition, the sign as the 2011 paper prints it."""
        return {name: 100 * (f - self.after[name]) / f for name, f in self.measured.items()}

    @property
    def worst_percent(self) -> float:
        """Largest error of all, in percent."""
        return max(float(np.abs(error).max()) for error in self.error_percent.values())

    @property
    def rms_percent(self) -> float:
        """Root mean square of all errors, in percent."""
        return float(np.sqrt(np.mean(np.concatenate(list(self.error_percent.values())) ** 2)))

    @property
    def bic(self) -> float:
        """Bayesian information criterion at the stated noise: lower is better supported."""
        count = sum(len(f) for f in self.measured.values())
        return self.chi2 + len(self.names) * float(np.log(count))


def pair_modes(
    pencil: Pencil,
    numbers: NDArray[np.int64],
    *,
    shape_rows: Matrix | None = None,
    shapes: Matrix | None = None,
) -> tuple[Matrix, Matrix]:
    """The model's modes that belong to the measured ones.

    Only bending modes count.  Without measured shapes they are taken by number, with them by the highest MAC.

    Returns
    -------
    omega : ndarray, (m,)
        In rad/s.
    Phi : ndarray, (n, m)
        Mass-normalised shapes.

    Raises
    ------
    ValueError
        If the model has too few bending modes.
    """
    modes = counted_modes(pencil.M, pencil.K, pencil.transverse, least=int(numbers.max()))
    if shape_rows is None or shapes is None:
        chosen = numbers - 1
    else:
        model = shape_rows @ modes.Phi
        cross = np.abs(shapes.T @ model) ** 2
        mac = cross / np.outer(np.sum(shapes**2, axis=0), np.sum(model**2, axis=0))
        chosen = np.argmax(mac, axis=1)
    return modes.omega[chosen], modes.Phi[:, chosen]


def model_frequencies(sets: Sequence[FrequencySet], values: Mapping[str, float]) -> dict[str, Matrix]:
    """The model's natural frequencies (Hz) that belong to the measured ones, by condition."""
    return {item.name: _Point.at(item, values).omega / (2 * np.pi) for item in sets}


def update_parameters(
    sets: Sequence[FrequencySet], parameters: Sequence[Parameter], *, max_iterations: int = 200
) -> FrequencyUpdate:
    """Fit `parameters` to all `sets` together, from their starting values.

    Parameters
    ----------
    sets
        Measured frequencies, each with the model of its condition.
    parameters
        What is free; anything else belongs inside the sets' `pencil`.
    max_iterations
        Of the trust-region search.
    """
    names = tuple(p.name for p in parameters)
    start = np.log([p.start for p in parameters])
    width = np.array([p.prior_log_std for p in parameters])
    with_prior = np.isfinite(width)
    history: list[Iteration] = []

    def values_at(theta: Matrix) -> dict[str, float]:
        return dict(zip(names, np.exp(theta).tolist(), strict=True))

    latest: tuple[bytes, list[_Point]] = (b"", [])

    def points(theta: Matrix) -> list[_Point]:
        """Models of all sets at `theta`; the search asks for residuals and sensitivities at the same place in turn."""
        nonlocal latest
        if latest[0] != theta.tobytes():
            latest = (theta.tobytes(), [_Point.at(item, values_at(theta)) for item in sets])
        return latest[1]

    def residual(theta: Matrix) -> Matrix:
        rows = [
            np.log(point.omega / (2 * np.pi * item.frequency_Hz)) * item.frequency_Hz / item.std_Hz
            for item, point in zip(sets, points(theta), strict=True)
        ]
        return np.concatenate([*rows, ((theta - start) / width)[with_prior]])

    def jacobian(theta: Matrix) -> Matrix:
        values = values_at(theta)
        history.append(Iteration(float(np.sum(residual(theta) ** 2)), values))
        rows = [
            point.log_sensitivity(values, names) * (item.frequency_Hz / item.std_Hz)[:, None]
            for item, point in zip(sets, points(theta), strict=True)
        ]
        return np.vstack([*rows, np.diag(1 / width)[with_prior]])

    bounds = np.log([[p.lower for p in parameters], [p.upper for p in parameters]])
    with np.errstate(divide="ignore"):
        found = least_squares(
            residual, start, jac=jacobian, bounds=bounds, x_scale="jac", max_nfev=max_iterations,
            xtol=1e-8, ftol=1e-9, gtol=1e-9,
        )  # fmt: skip
    J = np.asarray(found.jac)
    count = len(J) - int(with_prior.sum())
    values, dof = values_at(found.x), count - len(names)
    covariance = np.linalg.pinv(J.T @ J, hermitian=True, rcond=1e-14)
    _, singular_values, Vt = np.linalg.svd(J[:count], full_matrices=True)
    chi2 = float(np.sum(found.fun[:count] ** 2))
    log_std = np.sqrt(np.diag(covariance))
    return FrequencyUpdate(
        values=values,
        std={n: values[n] * float(s) for n, s in zip(names, log_std, strict=True)},
        names=names,
        covariance=covariance,
        residual_factor=float(np.sqrt(chi2 / dof)) if dof > 0 else float("nan"),
        singular_values=np.concatenate([singular_values, np.zeros(max(0, len(names) - count))]),
        directions=Vt.T,
        history=tuple(history),
        measured={item.name: item.frequency_Hz for item in sets},
        before=model_frequencies(sets, values_at(start)),
        after=model_frequencies(sets, values),
        chi2=chi2,
        objective=2 * float(found.cost),
        dof=dof,
        converged=found.status > 0,
    )


def update_from_starts(
    sets: Sequence[FrequencySet],
    parameters: Sequence[Parameter],
    *,
    factors: Mapping[str, Sequence[float]],
    coarse_iterations: int = 8,
) -> FrequencyUpdate:
    """:func:`update_parameters` from several starts, because frequencies often have more than one minimum.

    Every combination of `factors` multiplies the starting values; each is followed for `coarse_iterations`, and the
    best three to the end.  Priors stay where they are.
    """
    names = [p.name for p in parameters]
    trials = []
    for combination in itertools.product(*(factors.get(name, (1.0,)) for name in names)):
        moved = [
            p if np.isfinite(p.prior_log_std) else replace(p, start=float(np.clip(p.start * c, p.lower, p.upper)))
            for p, c in zip(parameters, combination, strict=True)
        ]
        trials.append((update_parameters(sets, moved, max_iterations=coarse_iterations), moved))
    trials.sort(key=lambda trial: trial[0].objective)
    final = []
    for coarse, moved in trials[:3]:
        again = [p if np.isfinite(p.prior_log_std) else replace(p, start=coarse.values[p.name]) for p in moved]
        update = update_parameters(sets, again)
        final.append(replace(update, history=coarse.history + update.history, before=coarse.before))
    return min(final, key=lambda update: update.objective)


@dataclass(frozen=True)
class _Point:
    """A condition's model at some parameter values: its matrices and the modes that belong to the measured ones."""

    pencil: Pencil
    omega: Matrix
    Phi: Matrix

    @classmethod
    def at(cls, item: FrequencySet, values: Mapping[str, float]) -> _Point:
        pencil = item.pencil(values)
        return cls(pencil, *pair_modes(pencil, item.numbers, shape_rows=item.shape_rows, shapes=item.shapes))

    def log_sensitivity(self, values: Mapping[str, float], names: Sequence[str]) -> Matrix:
        """Relative change of each frequency by that of each parameter, d ln f / d ln p, (m, k)."""
        S = np.zeros((len(self.omega), len(names)))
        for k, name in enumerate(names):
            change = np.zeros(len(self.omega))
            if name in self.pencil.dK:
                change += np.einsum("im,im->m", self.Phi, self.pencil.dK[name] @ self.Phi)
            if name in self.pencil.dM:
                change -= self.omega**2 * np.einsum("im,im->m", self.Phi, self.pencil.dM[name] @ self.Phi)
            S[:, k] = values[name] * change / (2 * self.omega**2)
        return S
