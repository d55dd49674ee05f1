"""Lines of measured frequency responses with their noise, put together in bins that are narrow near resonances.

The noise of a line is its coherence's, var |H| / |H|^2 = (1 - g2) / (2 n g2) with n averages (Bendat and Piersol,
Random Data, 4th ed., table 9.6), or, where no coherence is given or nobody says n, what a ratio of polynomials leaves
that is fitted to the line and its neighbours (the local rational method, McKelvey and Guerin 2012).
"""

from collections.abc import Sequence

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from scipy.signal import find_peaks

from recordings.errors import InputError
from recordings.responses import FoundResponse
from twin.arrays import Array
from twin.identify.limits import LIMITS as IDENTIFY
from twin.identify.responses.limits import LIMITS
from twin.identify.responses.matching import Matched
from twin.identify.spectra.broadband import BinnedResponse


def noise_of(found: FoundResponse) -> Array:
    """Variance of the complex relative error of each line (f,)."""
    g = found.coherence
    if g is not None and 0 < found.averages < LIMITS.averages:
        g = None
    elif g is not None and found.averages:
        return np.asarray((1 - g) / (found.averages * np.maximum(g, 1e-12)))
    left = _left_by_neighbours(found.H)
    if g is None:
        return left
    shape = (1 - g) / np.maximum(g, 1e-12)
    with np.errstate(divide="ignore", invalid="ignore"):
        scale = np.nanmedian(np.where(shape > 0, left / shape, np.nan)) if np.any(shape > 0) else 0.0
    return np.asarray(np.nan_to_num(scale) * shape)


def _left_by_neighbours(H: Array) -> Array:
    """The same from what a local ratio of polynomials leaves, a median over the window."""
    half = min(LIMITS.window, (len(H) - 1) // 2)
    x = np.arange(-half, half + 1) / half
    windows = sliding_window_view(H, 2 * half + 1)
    scaled = windows / np.sqrt(np.mean(np.abs(windows) ** 2, axis=1, keepdims=True))
    above = np.broadcast_to(
        np.vander(x, LIMITS.reduction_orders[0] + 1, increasing=True), (*scaled.shape, LIMITS.reduction_orders[0] + 1)
    )
    below = -scaled[:, :, None] * np.stack([x ** (k + 1) for k in range(LIMITS.reduction_orders[1])], axis=1)
    A = np.concatenate([above, below], axis=2)
    Q = np.linalg.qr(A)[0]
    residual = scaled - (Q @ (np.conj(np.swapaxes(Q, 1, 2)) @ scaled[:, :, None]))[:, :, 0]
    freedom = max(1, 2 * half + 1 - A.shape[2])
    # Of the line itself, whose level within the window the neighbours do not share.
    variance = np.sum(np.abs(residual) ** 2, axis=1) / freedom / np.abs(scaled[:, half]) ** 2
    return np.asarray(np.pad(variance, half, mode="edge"))


def resonances_of(frequency_Hz: Array, H: Array) -> Array:
    """Frequencies of the peaks of summed magnitudes of responses (f, o)."""
    level = np.log10(np.sum(np.abs(H) / np.median(np.abs(H), axis=0), axis=1))
    return np.asarray(frequency_Hz[find_peaks(_smooth(level), prominence=LIMITS.prominence)[0]])


def _smooth(level: Array) -> Array:
    return np.asarray(np.convolve(np.pad(level, 1, mode="edge"), [0.25, 0.5, 0.25], mode="valid"))


def reduce_responses(
    path: str, matched: Sequence[Matched], channels: Sequence[str], *, band_Hz: tuple[float, float]
) -> BinnedResponse:
    """Responses of one state, one for each channel, as bins.

    Parameters
    ----------
    channels
        In the order that is wanted.
    band_Hz
        Up to where the model is meant to hold.

    Raises
    ------
    InputError
        If the responses have not the same frequencies, or too few lines in the band say anything.
    """
    by_channel = {one.channel: one for one in matched}
    used = [by_channel[channel] for channel in channels]
    frequency = used[0].found.frequency_Hz
    for one in used[1:]:
        if len(one.found.frequency_Hz) != len(frequency) or not np.allclose(one.found.frequency_Hz, frequency):
            raise InputError(
                path, one.found.place, f"has other frequencies than {used[0].found.place}",
                "export all responses of a state on one axis",
            )  # fmt: skip
    H = np.stack([one.sign * one.found.H for one in used], axis=1)
    variance = np.stack([noise_of(one.found) for one in used], axis=1)
    coherent = [one.found.coherence for one in used]
    inside = (frequency >= band_Hz[0]) & (frequency <= band_Hz[1])
    peaks = resonances_of(frequency[inside], H[inside]) if inside.sum() > 2 else np.zeros(0)
    bends = _bends(H)
    variance = variance + (LIMITS.leakage * bends) ** 2
    clear = inside & np.all(variance < LIMITS.noisiest**2, axis=1)
    for g in coherent:
        clear &= True if g is None else g >= LIMITS.coherent
    if clear.sum() < 3:
        raise InputError(
            path, used[0].found.place,
            f"no lines between {band_Hz[0]:.3g} and {band_Hz[1]:.3g} Hz stand out of their noise",
            "the model is meant to hold there",
        )  # fmt: skip
    frequency, H, variance = frequency[clear], H[clear], variance[clear]
    steep = np.concatenate([peaks, *(_valleys(frequency, row) for row in H.T)])
    edges = _edges(frequency, steep)
    starts, counts = edges[:-1], np.diff(edges)
    of_bin = np.repeat(np.arange(len(starts)), counts)
    centre = np.add.reduceat(frequency, starts) / counts
    nearest = starts + counts // 2
    # Within a bin a response changes by less than its own size: the mean of logarithms about one of its lines.
    ratio = np.log(H / H[nearest][of_bin])
    mean = np.add.reduceat(ratio, starts, axis=0) / counts[:, None]
    noise = np.add.reduceat(variance, starts, axis=0) / counts[:, None] ** 2 + LIMITS.reproduced**2
    covariance = np.zeros((*noise.shape, noise.shape[1]), complex)
    covariance[:, np.arange(noise.shape[1]), np.arange(noise.shape[1])] = noise
    return BinnedResponse(
        run=path, time_s=0.0, frequency_Hz=centre, H=H[nearest] * np.exp(mean), relative_covariance=covariance,
        channels=tuple(channels), noise_density={}, distortion=np.ones(len(centre)),
        force_power=np.zeros(len(centre)), resonances_Hz=peaks,
    )  # fmt: skip


def _bends(H: Array) -> Array:
    """Second difference of each line (f, o), over itself."""
    bends = np.zeros(H.shape)
    bends[1:-1] = np.abs(H[2:] - 2 * H[1:-1] + H[:-2]) / np.abs(H[1:-1])
    return bends


def _valleys(frequency: Array, H: Array) -> Array:
    return np.asarray(frequency[find_peaks(-_smooth(np.log10(np.abs(H))), prominence=LIMITS.prominence)[0]])


def _edges(frequency: Array, steep: Array) -> NDArray[np.int64]:
    """Of bins on any axis; narrow beside the distance to the nearest steep place."""
    edges = [0]
    while edges[-1] < len(frequency):
        here = frequency[edges[-1]]
        distance = float(np.min(np.abs(here - steep), initial=here)) + IDENTIFY.half_width_Hz
        edges.append(max(edges[-1] + 1, int(np.searchsorted(frequency, here + IDENTIFY.bin_share * distance))))
    return np.array(edges)
