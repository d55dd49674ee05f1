"""Least-squares fit of a sine and its harmonics over a window of samples."""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from twin.arrays import Array
from twin.procedures.limits import LIMITS


@dataclass(frozen=True, kw_only=True)
class SineFit:
    """Complex harmonics of one channel over one window: x(t) = mean + Re sum_k harmonics[k-1] exp(2 pi i k f t).

    t counts from the moment named in the call; `std` is the standard deviation that white noise, of the size that the
    fit leaves, gives the real and imaginary part.
    """

    harmonics: Array
    mean: float
    std: float

    @property
    def phasor(self) -> complex:
        """The fundamental, peak value and phase."""
        return complex(self.harmonics[0])

    @property
    def distortion(self) -> float:
        """Root sum of squares of the higher harmonics over the fundamental."""
        return float(np.linalg.norm(self.harmonics[1:]) / max(abs(self.harmonics[0]), 1e-300))


def fit_sine(
    samples: Array,
    *,
    frequency_Hz: float,
    sample_rate_Hz: float,
    offset_s: float = 0.0,
    harmonics: int = 5,
    modulation: int = 0,
) -> SineFit:
    """Fit mean, fundamental and harmonics; ValueError if fewer samples are left than unknowns.

    Parameters
    ----------
    samples
        Shape (n,); NaN where samples were lost.
    frequency_Hz, sample_rate_Hz
        Known frequencies of generator and converter.
    offset_s
        Time of the first sample after the moment that phases refer to.
    harmonics
        Highest harmonic wanted; fewer are fitted where they would pass 45 % of the sample rate.
    modulation
        Order of the slow change of the fundamental that is fitted too, so that a transient is not taken for noise.
        The phasor stays the window's mean.
    """
    highest = max(1, min(harmonics, int(0.45 * sample_rate_Hz / frequency_Hz)))
    values = np.asarray(samples, dtype=np.float64)
    known = np.isfinite(values)
    valid = int(known.sum())
    if valid < 2 * (2 * highest + 1 + 2 * modulation):
        raise ValueError(f"{valid} samples are too few for {highest} harmonics")
    turns = frequency_Hz / sample_rate_Hz
    if len(values) > LIMITS.whole_fit:
        coefficients, squares = _fit_in_parts(values, known, turns, highest, modulation)
    else:
        design, inverse = _design(len(values), turns, highest, modulation)
        if valid == len(values):
            coefficients = inverse @ values
        else:
            design, values = design[known], values[known]
            coefficients = np.asarray(np.linalg.lstsq(design, values, rcond=None)[0], dtype=np.float64)
        residual = values - design @ coefficients
        squares = float(residual @ residual)
    noise = float(np.sqrt(squares / (valid - len(coefficients))))
    order = np.arange(1, highest + 1)
    raw = coefficients[1 : 2 * highest + 1 : 2] - 1j * coefficients[2 : 2 * highest + 1 : 2]
    found = np.zeros(harmonics, dtype=np.complex128)
    found[:highest] = raw * np.exp(-2j * np.pi * frequency_Hz * offset_s * order)
    return SineFit(harmonics=found, mean=float(coefficients[0]), std=noise * float(np.sqrt(2.0 / valid)))


def _fit_in_parts(values: Array, known: Array, turns: float, harmonics: int, modulation: int) -> tuple[Array, float]:
    """Coefficients and the sum of squares that they leave, without ever having the whole design matrix."""
    parts = [
        np.arange(first, min(first + LIMITS.whole_fit, len(values)))[known[first : first + LIMITS.whole_fit]]
        for first in range(0, len(values), LIMITS.whole_fit)
    ]
    gram, right = np.zeros(()), np.zeros(())
    for part in parts:
        columns = _columns(part, len(values), turns, harmonics, modulation)
        gram, right = gram + columns.T @ columns, right + columns.T @ values[part]
    coefficients = np.asarray(np.linalg.solve(gram, right), dtype=np.float64)
    squares = 0.0
    for part in parts:
        residual = values[part] - _columns(part, len(values), turns, harmonics, modulation) @ coefficients
        squares += float(residual @ residual)
    return coefficients, squares


@lru_cache(maxsize=4)
def _design(count: int, cycles_per_sample: float, harmonics: int, modulation: int) -> tuple[Array, Array]:
    """Design matrix of a whole window and its pseudo-inverse.

    Over whole cycles the columns are close to orthogonal, so that its normal equations lose nothing.
    """
    design = _columns(np.arange(count), count, cycles_per_sample, harmonics, modulation)
    inverse = np.linalg.solve(design.T @ design, design.T)
    return design, np.asarray(inverse, dtype=np.float64)


def _columns(places: Array, count: int, cycles_per_sample: float, harmonics: int, modulation: int) -> Array:
    """Columns [1, cos, sin, cos 2, sin 2, ..., P1 cos, P1 sin, ...] at some samples of a window of `count`.

    Legendre polynomials of time over the window keep the modulation apart from the mean phasor.
    """
    angle = 2 * np.pi * cycles_per_sample * places
    columns = [np.ones(len(places))]
    for k in range(1, harmonics + 1):
        columns += [np.cos(k * angle), np.sin(k * angle)]
    position = np.linspace(-1.0, 1.0, count)[places]
    for k in range(1, modulation + 1):
        shape = np.polynomial.Legendre.basis(k)(position)
        columns += [shape * np.cos(angle), shape * np.sin(angle)]
    return np.column_stack(columns)
