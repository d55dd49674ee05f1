"""Parameters of one fit to natural frequencies as a vector, with priors, bounds, residuals and sensitivities."""

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import norm

from twin.diagnose.cause import Parameter
from twin.diagnose.tables.measured import Measurement
from twin.diagnose.tables.model import Change, FrequencyModel

Array = NDArray[np.float64]
Changes = tuple[tuple[Change, dict[str, float]], ...]


class FrequencyResiduals:
    """Logarithms of moduli, then each change's parameters in units of their scales.

    Attributes
    ----------
    mean, precision : ndarray, (k,)
        Of the Gaussian priors.
    bounds : pair of ndarray, (k,)
    truncation : float
        Logarithm of the priors' mass within the bounds.
    """

    def __init__(
        self,
        model: FrequencyModel,
        measured: Sequence[Measurement],
        active: Changes,
        held: frozenset[str] = frozenset(),
    ) -> None:
        self.model, self.measured, self.active = model, measured, active
        used = {name for item in measured for name in model.conditions[item.condition].values()}
        self.base = [parameter for parameter in model.base if parameter.name in used]
        self.slots: list[tuple[int, Parameter]] = [
            (i, p)
            for i, (change, _) in enumerate(active)
            for p in change.parameters
            if i < len(active) - 1 or p.name not in held
        ]
        priors = [p.prior for _, p in self.slots]
        self.mean = np.array([np.log(b.nominal) for b in self.base] + [mean for mean, _ in priors])
        self.precision = np.array([b.log_std**-2 for b in self.base] + [precision for _, precision in priors])
        limits = [(-np.inf, np.inf)] * len(self.base) + [(p.lower / p.scale, p.upper / p.scale) for _, p in self.slots]
        self.bounds = (np.array([low for low, _ in limits]), np.array([high for _, high in limits]))
        strengths = [p for _, p in self.slots if not p.is_location]
        self.truncation = sum(
            float(np.log(norm.cdf((p.upper - p.null) / p.scale) - norm.cdf((p.lower - p.null) / p.scale)))
            for p in strengths
        )
        steps = [0.1 * (p.upper - p.lower) / p.scale if p.is_location else 1.0 for _, p in self.slots]
        self.largest_step = np.array([0.5] * len(self.base) + steps)

    def start(self, moduli: Mapping[str, float]) -> Array:
        """Where to begin."""
        base = [np.log(moduli.get(b.name, b.nominal)) for b in self.base]
        return np.array(base + [self.active[i][1][p.name] / p.scale for i, p in self.slots])

    def values(self, x: Array) -> tuple[dict[str, float], Changes]:
        """Moduli, and changes with their values."""
        n = len(self.base)
        moduli = {b.name: float(np.exp(v)) for b, v in zip(self.base, x[:n], strict=True)}
        tables = [dict(values) for _, values in self.active]
        for (i, p), v in zip(self.slots, x[n:], strict=True):
            tables[i][p.name] = float(v * p.scale)
        return moduli, tuple((change, table) for (change, _), table in zip(self.active, tables, strict=True))

    def evaluate(self, x: Array) -> tuple[Array, Array]:
        """Residuals (n,) and sensitivities of the model (n, k); NaN where there is no such structure."""
        moduli, active = self.values(x)
        n = len(self.base)
        try:
            matrices = self.model.matrices(active)
            moved = []
            for k, (_, p) in enumerate(self.slots):
                step = 1e-4 * (p.upper - p.lower if p.is_location else p.scale)
                step = -step if x[n + k] * p.scale + step > p.upper else step
                y = x.copy()
                y[n + k] += step / p.scale
                moved.append((self.model.matrices(self.values(y)[1]), step / p.scale))
            rows, sensitivities = [], []
            for item in self.measured:
                names = self.model.conditions[item.condition]
                now = {term: moduli[name] for term, name in names.items()}
                K = matrices.stiffness(now)
                omega, Phi = matrices.modes(now, item.number)
                change = np.zeros((len(omega), len(x)))
                for k, b in enumerate(self.base):
                    for term in (term for term, name in names.items() if name == b.name):
                        change[:, k] += np.einsum("im,im->m", Phi, now[term] * matrices.terms[term] @ Phi)
                for k, (other, step) in enumerate(moved):
                    by_K = np.einsum("im,im->m", Phi, (other.stiffness(now) - K) @ Phi)
                    by_M = np.einsum("im,im->m", Phi, (other.M - matrices.M) @ Phi)
                    change[:, n + k] = (by_K - omega**2 * by_M) / step
                sensitivities.append(change / (2 * omega[:, None] ** 2) / item.relative_std[:, None])
                rows.append(_misfit(item, omega))
        except (np.linalg.LinAlgError, ValueError):
            count = sum(len(item.number) for item in self.measured)
            return np.full(count, np.nan), np.zeros((count, len(x)))
        return np.concatenate(rows), np.vstack(sensitivities)


def _misfit(item: Measurement, omega: Array) -> Array:
    return np.asarray(np.log(2 * np.pi * item.frequency_Hz / omega) / item.relative_std)
