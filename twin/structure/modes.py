"""Normal modes of the undamped structure and their sensitivities."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh

MOST_RIGID = 6
RIGID = 1e-4
"""Natural frequency of a rigid motion at most, over that of the lowest that must be elastic."""


@dataclass(frozen=True)
class Modes:
    """Natural frequencies omega (rad/s), rising, and mass-normalised mode shapes as columns of Phi, (n, m)."""

    omega: NDArray[np.float64]
    Phi: NDArray[np.float64]

    @property
    def frequency_Hz(self) -> NDArray[np.float64]:
        """Natural frequencies in Hz."""
        return self.omega / (2 * np.pi)


def normal_modes(M: NDArray[np.float64], K: NDArray[np.float64], count: int | None = None) -> Modes:
    """The lowest `count` modes, or all of them.

    Rigid-body modes come out with omega = 0 instead of the root of a tiny negative number.
    """
    subset = None if count is None else (0, min(count, len(M)) - 1)
    values, Phi = eigh(K, M, subset_by_index=subset)
    return Modes(np.sqrt(np.maximum(values, 0.0)), Phi)


def rigid_motions(omega: NDArray[np.float64]) -> int:
    """How many of rising natural frequencies are those of motions that nothing holds: six at most, of one body."""
    elastic = omega[min(MOST_RIGID, len(omega) - 1)]
    return int(np.count_nonzero(omega[:MOST_RIGID] < RIGID * elastic))
