"""Missing samples filled in by what the signal itself predicts from both sides.

A line drawn across a gap of some periods takes that share of the motion away and adds as much noise: at one sample in
two hundred the response is 0.5 % small, several times what a model is wrong by.  A structure's motion is a few decaying
modes, which a linear prediction knows: the missing samples x_m are those for which the prediction errors of all samples
that see them are least (Janssen, Veldhuis and Vries, IEEE Trans. ASSP 34 (1986) 317-330)::

    e_t = sum a_k x_(t-k):        B_mm x_m = - B_mk x_k,        B_ij = sum_k a_k a_(k+|i-j|)

The prediction is the one of the samples as they are filled so far, and improves with them.
"""

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solve, solve_toeplitz

from twin.arrays import Array
from twin.identify.limits import LIMITS

TURNS = 2


def fill_gaps(samples: Array) -> Array:
    """Samples with those that are not finite filled in.

    Parameters
    ----------
    samples : ndarray, (n,)
        At least one finite.
    """
    missing = ~np.isfinite(samples)
    if not missing.any():
        return samples
    filled = np.array(samples, float)
    sound = np.flatnonzero(~missing)
    filled[missing] = np.interp(np.flatnonzero(missing), sound, filled[sound])
    order = min(LIMITS.gaps_order, len(sound) // 4)
    if order < 2 or _straight(sound, filled[sound]):
        return filled
    mean = float(np.mean(filled[sound]))
    gaps = [gap for gap in _gaps(missing, order) if len(gap) <= LIMITS.gaps_most]
    for _ in range(TURNS):
        B = _prediction_products(filled - mean, order)
        around = np.concatenate([B[:0:-1], B])
        for gap in gaps:
            first, last = max(gap[0] - order, 0), gap[-1] + order + 1
            near, at = filled[first:last] - mean, gap - first
            near[at] = 0.0
            pull = np.convolve(near, around)[order : order + len(near)][at]
            lag = np.abs(at[:, None] - at)
            B_mm = np.where(lag <= order, B[np.minimum(lag, order)], 0.0)
            filled[gap] = mean - solve(B_mm, pull, assume_a="pos")
    return filled


def _straight(positions: Array, values: Array) -> bool:
    """Whether a straight line is all that there is to predict."""
    left = values - np.polynomial.Polynomial.fit(positions, values, 1)(positions)
    return bool(np.ptp(left) <= LIMITS.gaps_straight * np.max(np.abs(values)))


def _gaps(missing: NDArray[np.bool_], order: int) -> list[Array]:
    """Positions of missing samples, split where more than `order` sound ones lie between."""
    positions = np.flatnonzero(missing)
    return np.split(positions, np.flatnonzero(np.diff(positions) > order) + 1)


def _prediction_products(x: Array, order: int) -> Array:
    """B (order + 1,) by lag, of the prediction that leaves least of `x`."""
    spectrum = np.abs(np.fft.rfft(x, 2 * len(x))) ** 2
    r = np.fft.irfft(spectrum)[: order + 1]
    r[0] *= 1 + LIMITS.self_noise
    a = np.concatenate([[1.0], -solve_toeplitz(r[:-1], r[1:])])
    return np.asarray(np.correlate(a, a, mode="full")[order:])
