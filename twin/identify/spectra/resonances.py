"""Which measured frequencies belong to the same resonance."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.limits import LIMITS


def by_resonance(omega: Array) -> list[NDArray[np.intp]]:
    """Groups of frequencies with a gap between them, from the lowest group to the highest.

    Parameters
    ----------
    omega : ndarray, (s,)
        Frequencies of steps, or one of each sweep, in any unit.

    Returns
    -------
    list of ndarray
        Places of each group's frequencies in `omega`, in their order there.
    """
    rising = np.argsort(omega, kind="stable")
    gaps = np.flatnonzero(omega[rising][1:] > LIMITS.resonances_apart * omega[rising][:-1]) + 1
    return [np.sort(group) for group in np.split(rising, gaps) if len(group)]


def same_resonance(one: Any, two: Any) -> NDArray[np.bool_]:
    """Whether frequencies are too near each other to belong to different resonances."""
    return np.asarray(np.abs(np.log(one / two)) < np.log(LIMITS.resonances_apart))
