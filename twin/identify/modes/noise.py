"""The noise of frequency responses that came without one."""

import numpy as np
from scipy.optimize import nnls

from twin.arrays import Array
from twin.identify.limits import LIMITS

PARTS = 30
MEDIAN = float(np.log(2))
"""Of an exponential variable with mean one."""


def noise_of_responses(H: Array) -> Array:
    """Root of the complex variance of each line, (f, o), from the roughness of the responses (f, o) themselves.

    Resonances are narrow beside the stretches over which noise is taken to be alike, and a median does not see them.
    """
    square = np.abs(H[:-2] - 2 * H[1:-1] + H[2:]) ** 2 / 6
    return np.sqrt(_local(np.concatenate([square[:1], square, square[-1:]])) + _floor(H))


def noise_of_residual(residual: Array, model: Array) -> Array:
    """The same from what a model (f, o) leaves: a constant noise and one in proportion, both varying along the band."""
    out = np.empty(residual.shape)
    for o in range(residual.shape[1]):
        size, square = np.abs(model[:, o]) ** 2, np.abs(residual[:, o]) ** 2
        parts = np.array_split(np.argsort(size), min(PARTS, len(size) // 8))
        rows = np.array([[1.0, np.median(size[part])] for part in parts])
        level = np.array([np.median(square[part]) for part in parts]) / MEDIAN + np.finfo(float).tiny
        # Each part counts alike, relative to its own level.
        A = rows / level[:, None]
        norm = np.linalg.norm(A, axis=0)
        out[:, o] = np.column_stack([np.ones_like(size), size]) @ (nnls(A / norm, np.ones(len(level)))[0] / norm)
    out = out + _floor(model)
    return np.sqrt(out * _local(np.abs(residual) ** 2 / out))


def _local(square: Array) -> Array:
    """Mean of exponentially distributed squares around each line, by their median."""
    lines = np.arange(len(square))
    window = min(LIMITS.noise_surroundings, len(square))
    places = np.unique(np.append(lines[:: LIMITS.noise_spacing], len(square) - 1))
    starts = np.clip(places - window // 2, 0, len(square) - window)
    median = np.array([np.median(square[start : start + window], axis=0) for start in starts]) / MEDIAN
    return np.stack([np.interp(lines, places, column) for column in median.T], axis=1)


def _floor(H: Array) -> Array:
    return np.asarray(1e-24 * np.max(np.abs(H) ** 2, axis=0) + np.finfo(float).tiny)
