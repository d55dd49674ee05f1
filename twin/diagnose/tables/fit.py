"""Fit of moduli and of the parameters of causes to natural frequencies, with its evidence.

Residuals are ln f measured minus ln f of the model, in units of each frequency's standard deviation.  Where a table
states none, all its standard deviations share an unknown factor with a log-normal prior, which the evidence integrates
over: what a model leaves then widens its own uncertainty instead of counting as a certain contradiction.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp
from scipy.stats import chi2 as chi_square

from twin.diagnose.tables.measured import Measurement
from twin.diagnose.tables.model import Active, Change, FrequencyModel
from twin.diagnose.tables.residuals import FrequencyResiduals
from twin.identify.gauss_newton import Solution, minimise

Array = NDArray[np.float64]
SPREAD = float(np.log(3.0))
"""Standard deviation of the logarithm of an assumed standard deviation: right to within a factor of three."""
SCALES = np.geomspace(0.03, 60.0, 60)


@dataclass(frozen=True)
class Fit:
    """A fitted model.

    Attributes
    ----------
    active : tuple
        Changes with their values.
    moduli, moduli_std, std
        Of the base parameters, and of each change's.
    chi2 : float
        At the stated or assumed standard deviations.
    dof : float
        Frequencies minus parameters that they determine.
    scale : float
        Most probable factor on standard deviations that were assumed; 1 where all were stated.
    frequency_Hz : dict of ndarray
        The model's, by condition.
    residual : ndarray
        In standard deviations as stated or assumed.
    rms_error : float
        Root-mean-square relative error of the frequencies.
    covariance : ndarray, (b, b)
        Of the moduli's logarithms, in the order of `moduli`.
    settled : bool
        Whether the search came to rest.
    """

    active: tuple[tuple[Change, dict[str, float]], ...]
    moduli: dict[str, float]
    moduli_std: dict[str, float]
    std: tuple[dict[str, float], ...]
    chi2: float
    dof: float
    scale: float
    log_evidence: float
    frequency_Hz: dict[str, Array]
    residual: Array
    rms_error: float
    covariance: Array
    settled: bool

    @property
    def keys(self) -> tuple[str, ...]:
        """What is named."""
        return tuple(change.key for change, _ in self.active)

    @property
    def chi2_per_dof(self) -> float:
        """Where no degree of freedom is left, per one."""
        return self.chi2 / max(1.0, self.dof)


@dataclass(frozen=True)
class Problem:
    """A model and what was measured of it."""

    model: FrequencyModel
    measured: tuple[Measurement, ...]

    @property
    def count(self) -> int:
        """Number of frequencies."""
        return sum(len(item.number) for item in self.measured)

    @property
    def stated(self) -> bool:
        """Whether every standard deviation is known."""
        return all(item.stated for item in self.measured)

    def without(self, index: int) -> Problem:
        """The problem without one frequency, counted through all conditions."""
        kept, first = [], 0
        for item in self.measured:
            keep = np.arange(first, first + len(item.number)) != index
            first += len(item.number)
            if keep.any():
                kept.append(item.select(keep))
        return Problem(self.model, tuple(kept))

    def threshold(self, dof: float, probability: float = 0.01) -> float:
        """Chi2 per degree of freedom that a right model exceeds with this probability."""
        dof = max(1.0, dof)
        if self.stated:
            return float(chi_square.isf(probability, dof) / dof)
        scales, log_prior = self._scales()
        grid = np.geomspace(0.1, 1e5, 600)
        exceeded = np.exp(log_prior) @ chi_square.sf(grid * dof / scales[:, None] ** 2, dof)
        return float(np.exp(np.interp(-probability, -exceeded, np.log(grid))))

    def frequencies(self, fit: Fit, numbers: Mapping[str, NDArray[np.int64]]) -> dict[str, Array]:
        """The fitted model's frequencies (Hz) of other modes, by condition."""
        matrices = self.model.matrices(fit.active)
        moduli = {b.name: b.nominal for b in self.model.base} | fit.moduli
        found = {}
        for name, wanted in numbers.items():
            by_term = {term: moduli[base] for term, base in self.model.conditions[name].items()}
            found[name] = matrices.modes(by_term, wanted)[0] / (2 * np.pi)
        return found

    def fit(
        self, active: Active, *, start: Mapping[str, float] | None = None, held: frozenset[str] = frozenset(),
        iterations: int = 12, scale: float | None = None, tolerance: float = 0.02,
    ) -> Fit:  # fmt: skip
        """Fit the moduli and the parameters of `active` from their values there.

        Parameters
        ----------
        start
            Moduli to begin from; the assumed ones by default.
        held
            Parameters of the last change that keep their values.
        scale
            Factor on assumed standard deviations; by default the fit is repeated at the most probable one.
        """
        system = FrequencyResiduals(
            self.model, self.measured, tuple((change, dict(values)) for change, values in active), held
        )
        x = system.start(start or {})
        factor = scale or 1.0
        for _ in range(1 if self.stated or scale else 2):
            weight = self._weight(factor)
            solution = minimise(
                _weighted(system, weight), x, mean=system.mean, precision=np.diag(system.precision),
                bounds=system.bounds, iterations=iterations, tolerance=tolerance, largest_step=system.largest_step,
            )  # fmt: skip
            x = solution.x
            log_evidence, factor = self._evidence(system, solution, weight)
        return self._finish(system, solution, weight, log_evidence, factor)

    def score(self, active: Active, start: Mapping[str, float], held: frozenset[str]) -> float:
        """Log evidence that a fit would reach if the model were linear about `active`; minus infinity out of bounds."""
        system = FrequencyResiduals(
            self.model, self.measured, tuple((change, dict(values)) for change, values in active), held
        )
        x = system.start(start)
        r, J = system.evaluate(x)
        if not np.isfinite(r).all():
            return -np.inf
        away, P = x - system.mean, np.diag(system.precision)
        scales, log_prior = self._scales()
        values = np.full(len(scales), -np.inf)
        for i, scale in enumerate(scales):
            w = self._weight(float(scale))
            A = (J * w[:, None]).T @ (J * w[:, None]) + P
            g = J.T @ (w**2 * r) - P @ away
            step = np.linalg.solve(A, g)
            inside = np.all(x + step >= system.bounds[0] - 1e-9) and np.all(x + step <= system.bounds[1] + 1e-9)
            cost = np.sum((w * r) ** 2) + away @ P @ away - (g @ step if inside else 0.0)
            values[i] = np.sum(np.log(w)) - 0.5 * cost - 0.5 * np.linalg.slogdet(A)[1]
        return float(logsumexp(values + 0.5 * np.sum(np.log(system.precision)) - system.truncation + log_prior))

    def _finish(
        self, system: FrequencyResiduals, solution: Solution, weight: Array, log_evidence: float, factor: float
    ) -> Fit:
        residual, J = solution.residual / weight, solution.jacobian / weight[:, None]
        final = self._weight(factor)[:, None]
        data = (J * final).T @ (J * final)
        covariance = np.linalg.inv(data + np.diag(system.precision))
        deviation = np.sqrt(np.diag(covariance))
        moduli, active = system.values(solution.x)
        n, errors = len(moduli), [dict[str, float]() for _ in active]
        for k, (i, p) in enumerate(system.slots):
            errors[i][p.name] = float(deviation[n + k] * p.scale)
        logs = np.concatenate([np.log(item.frequency_Hz) - part for item, part in zip(
            self.measured, np.split(residual * self._std(), self._splits()), strict=True)])  # fmt: skip
        model = np.split(np.exp(logs), self._splits())
        return Fit(
            active=active,
            moduli=moduli,
            moduli_std={name: value * float(s) for (name, value), s in zip(moduli.items(), deviation, strict=False)},
            std=tuple(errors),
            chi2=float(residual @ residual),
            dof=self.count - float(np.trace(covariance @ data)),
            scale=factor,
            log_evidence=log_evidence,
            frequency_Hz={item.condition: f for item, f in zip(self.measured, model, strict=True)},
            residual=residual,
            rms_error=float(np.sqrt(np.mean((residual * self._std()) ** 2))),
            covariance=np.asarray(covariance[:n, :n]),
            settled=solution.settled,
        )

    def _evidence(self, system: FrequencyResiduals, solution: Solution, weight: Array) -> tuple[float, float]:
        """Laplace's log evidence about `solution`, and the most probable factor on assumed deviations."""
        r, J = solution.residual / weight, solution.jacobian / weight[:, None]
        away, P = solution.x - system.mean, np.diag(system.precision)
        scales, log_prior = self._scales()
        values = np.zeros(len(scales))
        for i, scale in enumerate(scales):
            w = self._weight(float(scale))
            A = (J * w[:, None]).T @ (J * w[:, None]) + P
            cost = np.sum((w * r) ** 2) + away @ P @ away
            values[i] = np.sum(np.log(w)) - 0.5 * cost - 0.5 * np.linalg.slogdet(A)[1]
        values += 0.5 * np.sum(np.log(system.precision)) - system.truncation + log_prior
        return float(logsumexp(values)), float(scales[np.argmax(values)])

    def _scales(self) -> tuple[Array, Array]:
        """Factors on assumed standard deviations, and the logarithms of their prior probabilities."""
        if self.stated:
            return np.ones(1), np.zeros(1)
        log_prior = -0.5 * (np.log(SCALES) / SPREAD) ** 2
        return SCALES, np.asarray(log_prior - logsumexp(log_prior))

    def _weight(self, scale: float) -> Array:
        return np.concatenate([np.full(len(item.number), 1.0 if item.stated else 1 / scale) for item in self.measured])

    def _std(self) -> Array:
        return np.concatenate([item.relative_std for item in self.measured])

    def _splits(self) -> NDArray[np.int64]:
        return np.cumsum([len(item.number) for item in self.measured])[:-1]


def _weighted(system: FrequencyResiduals, weight: Array) -> Callable[[Array], tuple[Array, Array]]:
    """Residuals and sensitivities, their rows times `weight`."""

    def evaluate(x: Array) -> tuple[Array, Array]:
        r, J = system.evaluate(x)
        return weight * r, weight[:, None] * J

    return evaluate
