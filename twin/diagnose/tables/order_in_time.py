"""Whether resonances move with the order in which sweeps were run, beside a law of amplitude."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.stats import spearmanr

from twin.arrays import Array
from twin.diagnose.tables.limits import LIMITS
from twin.diagnose.tables.result import SweepRow
from twin.identify.estimate import Estimate
from twin.identify.rms import rms


@dataclass(frozen=True)
class FrequencyDrift:
    """A resonance that moves from sweep to sweep beside the law: its rate, and errors of sweeps left out."""

    rate_Hz: Estimate
    without: Array
    left_out: Array

    @property
    def pays(self) -> bool:
        """Whether it is clear, and predicts sweeps that were left out at least twice as well."""
        return _is_clear(self.rate_Hz) and rms(self.left_out) < 0.5 * rms(self.without)


@dataclass(frozen=True)
class Jump:
    """The best single jump of the resonance before a sweep, with rms errors of left-out sweeps without and with it."""

    left_out: float
    before: str
    size_Hz: Estimate
    without: float

    @property
    def clear(self) -> bool:
        """Whether it is large, and predicts sweeps that were left out at least twice as well."""
        return _is_clear(self.size_Hz) and self.left_out < 0.5 * self.without


def find_jump(rows: Sequence[SweepRow], scale: float) -> Jump:
    """The resonance jumps once, between two sweeps, and stays there."""
    amplitude, f = (np.array([getattr(row, name) for row in rows]) for name in ("amplitude_m_per_s2", "frequency_Hz"))
    without = rms(_smooth(amplitude, f)[1])
    tried = []
    for k in range(2, len(f) - 1):
        columns, errors = _smooth(amplitude, f, (np.arange(len(f)) >= k).astype(float))
        tried.append(Jump(rms(errors), rows[k].sweep, _last(columns, f, scale), without))
    return min(tried, key=lambda jump: jump.left_out)


def find_drift(rows: Sequence[SweepRow], scale: float) -> FrequencyDrift | None:
    """None where order in time and amplitude are the same thing."""
    amplitude, order = np.array([row.amplitude_m_per_s2 for row in rows]), np.array([float(row.order) for row in rows])
    if abs(float(spearmanr(amplitude, order).statistic)) > LIMITS.confounded_order:
        return None
    f = np.array([row.frequency_Hz for row in rows])
    _, without = _smooth(amplitude, f)
    columns, left_out = _smooth(amplitude, f, order - order.mean())
    return FrequencyDrift(_last(columns, f, scale), without, left_out)


def _is_clear(size: Estimate) -> bool:
    return abs(size.value) > LIMITS.least_deviations * size.std


def _smooth(amplitude: Array, f: Array, *beside: Array) -> tuple[Array, Array]:
    """A polynomial law of amplitude with columns beside it, and its left-out errors, of the order with the least."""
    powers = [
        np.vander(amplitude / amplitude.max(), order + 1) for order in range(min(LIMITS.most_order, len(f) - 4) + 1)
    ]
    tried = [np.column_stack([columns, *beside]) for columns in powers]
    errors = [_left_out(columns, f) for columns in tried]
    best = int(np.argmin([rms(error) for error in errors]))
    return tried[best], errors[best]


def _last(columns: Array, f: Array, scale: float) -> Estimate:
    """The last column's coefficient."""
    coefficients = np.linalg.lstsq(columns, f, rcond=None)[0]
    spread = np.sum((f - columns @ coefficients) ** 2) / max(len(f) - columns.shape[1], 1)
    covariance = np.linalg.pinv(columns.T @ columns) * max(float(spread), scale**2)
    return Estimate(float(coefficients[-1]), float(np.sqrt(covariance[-1, -1])))


def _left_out(columns: Array, f: Array) -> Array:
    """Each frequency minus its prediction by the least squares of all others."""
    hat = columns @ np.linalg.pinv(columns)
    return np.asarray((f - hat @ f) / np.maximum(1 - np.diag(hat), 1e-6))
