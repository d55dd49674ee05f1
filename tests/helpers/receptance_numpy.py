"""Receptances after a change of stiffness in plain numpy: what the compiled ones are held against."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from twin.identify.linear.receptance import ModalBasis

Complex = NDArray[Any]
Real = NDArray[Any]


def update_receptance_numpy(R: Complex, layer: slice, S: Complex) -> Complex:
    """Springs S (f, r) put onto a layer, by Woodbury's formula with a solve at each frequency."""
    RL = R[:, :, layer]
    A = np.eye(S.shape[1]) + RL[:, layer, :] * S[:, None, :]
    T = S[:, :, None] * np.linalg.solve(A, np.broadcast_to(np.eye(S.shape[1]), A.shape))
    return np.asarray(R - RL @ T @ R[:, layer, :])


def softened_receptance_numpy(basis: ModalBasis, rows: Real, omega: Real, S: Complex) -> Complex:
    """All receptances, then Woodbury's formula for springs S on the first ports."""
    return update_receptance_numpy(basis.receptance(rows, omega), slice(0, S.shape[1]), S)
