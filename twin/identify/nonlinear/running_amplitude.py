"""The loss of a slip that has harmonics: a force in proportion to velocity whose coefficient the running motion sets.

The coefficient is the loss modulus at the running amplitude over the running frequency: both are root mean squares, to
which every harmonic counts.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from twin.arrays import Array
from twin.identify.nonlinear.joint_law import LayerLaw


def squares_of(harmonics: Array, orders: Sequence[int]) -> Array:
    """What harmonics (s, h, p) of these orders add to twice the mean squares of slip and velocity, m2, (s, p, 2).

    The velocity is that over the fundamental's omega.  A static part has none, and counts twice in the displacement, as
    the mean square of a wave is half of its amplitude's.
    """
    each = np.abs(harmonics) ** 2
    return np.stack([np.sum(count[:, None] * each, axis=1) for count in counts_of(orders)], axis=2)


def counts_of(orders: Sequence[int]) -> Array:
    """What the square of a harmonic of each of these orders counts in displacement and velocity, (2, h)."""
    order = np.array(orders, float)
    return np.stack([np.where(order == 0, 2.0, 1.0), order**2])


def _running(amplitude: Array, squares: Array) -> tuple[Array, Array, Array]:
    """Running amplitude, the fundamental's frequency over the running one, and that share of the squares."""
    first = np.maximum(amplitude**2, 1e-300)
    displacement, velocity = first + squares[..., 0], first + squares[..., 1]
    return np.sqrt(displacement), np.sqrt(displacement / velocity), first / displacement


def running_loss_basis(law: LayerLaw, amplitude: Array, squares: Array) -> tuple[Array, Array]:
    """Matrices (s, p, m) from the loss at the knots to that of slips (s, p) with harmonics; and by their logarithms.

    The logarithms are those of the fundamentals, beside :func:`squares_of` their harmonics, which stay.
    """
    size, fall, share = _running(amplitude, squares)
    basis, by_size = law.loss_with_slope(size)
    of_fall = (share * (1 - fall**2))[..., None]
    return basis * fall[..., None], (by_size * share[..., None] + basis * of_fall) * fall[..., None]


def running_loss(laws: Sequence[LayerLaw], joint: NDArray[np.int64], amplitude: Array, squares: Array) -> Array:
    """Loss modulus (s, p) of slips that belong to these joints, N/m2."""
    found = np.empty_like(amplitude)
    for number, law in enumerate(laws):
        own = joint == number
        found[:, own] = running_loss_basis(law, amplitude[:, own], squares[:, own])[0] @ law.loss
    return found


def running_loss_by_squares(
    laws: Sequence[LayerLaw], joint: NDArray[np.int64], amplitude: Array, squares: Array
) -> Array:
    """Derivatives (s, p, 2) of :func:`running_loss` by the squares that harmonics add, N/m4."""
    size, fall, _ = _running(amplitude, squares)
    found = np.empty((*amplitude.shape, 2))
    for number, law in enumerate(laws):
        own = joint == number
        basis, by_size = law.loss_with_slope(size[:, own])
        value, slope = basis @ law.loss, by_size @ law.loss
        found[:, own, 0] = (value + slope) * fall[:, own] / (2 * size[:, own] ** 2)
        found[:, own, 1] = -value * fall[:, own] ** 3 / (2 * size[:, own] ** 2)
    return found
