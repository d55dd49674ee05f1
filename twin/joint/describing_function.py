"""The describing function by quadrature (2011 paper, equation 6), for any law that can follow a path in time."""

from collections.abc import Callable

import numpy as np

from twin.arrays import Array


def describing_function(
    path: Callable[[Array], Array], amplitude: Array | float, *, points: int = 4096, cycles: int = 3
) -> Array:
    """Complex equivalent stiffness of a force for e = A sin(theta).

    ``N(A) = 1/(pi A) integral f (sin + j cos) dtheta`` over one period: the real part stores, the imaginary part
    loses energy, pi Im(N) A^2 a cycle.

    Parameters
    ----------
    path
        Force along the samples of a path that starts at rest at zero.
    cycles
        How many to run; the last is taken, when laws with memory have settled.

    Returns
    -------
    ndarray of complex, shaped like `amplitude`
    """
    values = np.atleast_1d(np.asarray(amplitude, float))
    theta = 2 * np.pi * np.arange(1, cycles * points + 1) / points
    last = slice((cycles - 1) * points, None)
    weight = np.sin(theta[last]) + 1j * np.cos(theta[last])
    result = np.array([np.dot(path(A * np.sin(theta))[last], weight) * 2 / (points * A) for A in values])
    return result.reshape(np.shape(amplitude))
