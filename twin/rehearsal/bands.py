"""Which resonance each step of a sweep belongs to."""

import numpy as np

from twin.arrays import Array
from twin.identify.spectra.resonances import by_resonance, same_resonance
from twin.rehearsal.limits import LIMITS


def band_numbers(frequency_Hz: Array, size: Array) -> Array:
    """Number the resonances of a sweep from the lowest, 0, and give each step the number of its own, (s,).

    Steps with a gap between them belong to different resonances; so do the steps on either side of the smallest
    response between two peaks.

    Parameters
    ----------
    frequency_Hz, size : ndarray, (s,)
        Of each step: its frequency, and how large the response is per force, in any unit.
    """
    numbers = np.zeros(len(frequency_Hz), np.intp)
    count = 0
    for group in _groups(frequency_Hz):
        rising = group[np.argsort(frequency_Hz[group], kind="stable")]
        for band in np.split(rising, _valleys(frequency_Hz[rising], size[rising])):
            numbers[band] = count
            count += 1
    return numbers


def _groups(frequency_Hz: Array) -> list[Array]:
    """Places of the steps between gaps, at least ``LIMITS.bands_fewest`` in each group where there are so many."""
    found: list[Array] = []
    for group in by_resonance(frequency_Hz):
        if found and min(len(found[-1]), len(group)) < LIMITS.bands_fewest:
            found[-1] = np.concatenate([found[-1], group])
        else:
            found.append(group)
    return found


def _valleys(frequency_Hz: Array, size: Array) -> list[int]:
    """Places of the smallest responses between peaks that none near them exceeds; frequencies rise."""
    peaks = [i for i in range(1, len(size) - 1) if size[i] == size[same_resonance(frequency_Hz, frequency_Hz[i])].max()]
    found: list[int] = []
    last = peaks[0] if peaks else 0
    for i in peaks[1:]:
        valley = last + int(np.argmin(size[last:i]))
        if size[valley] < LIMITS.bands_sunk * min(size[last], size[i]):
            found.append(valley)
            last = i
        elif size[i] > size[last]:
            last = i
    return found
