"""Derivatives of Timoshenko's beam element by the shear ratio s = E / (kappa G).

The shape functions (a + phi b) / (1 + phi) of :mod:`twin.structure.elements.beam` have the derivative
(b - a) / (1 + phi)^2 by phi = 12 EI s / (EA L^2).
"""

import numpy as np
from numpy.typing import ArrayLike, NDArray

from twin.structure.elements.beam import BENDING, DEFLECTION, ROTATION, SLENDER, THICK, per_length, shear_parameter

Matrix = NDArray[np.float64]


def timoshenko_mass_derivative(
    *, mass_per_length: float, radius2: float, length: ArrayLike, shear_ratio: float
) -> Matrix:
    """Derivative of :func:`~twin.structure.elements.beam.beam_mass` with respect to `shear_ratio`, (..., 6, 6)."""
    L = np.asarray(length, float)[..., None, None]
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=L)
    dM = np.zeros((*np.shape(length), 6, 6))
    by_phi = sum(
        factor * (mixed - 2 * one + phi * (2 * two - mixed))
        for factor, (one, mixed, two) in ((1.0, DEFLECTION), (radius2 / L**2, ROTATION))
    )
    dM[BENDING] = mass_per_length * L * by_phi / (1 + phi) ** 3 * 12.0 * radius2 / L**2 * per_length(length)
    return dM


def timoshenko_stiffness_derivative(*, EI: float, radius2: float, length: ArrayLike, shear_ratio: float) -> Matrix:
    """Derivative of the element's stiffness with respect to `shear_ratio` at a given EI (N m2), (..., 6, 6)."""
    L = np.asarray(length, float)[..., None, None]
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=L)
    dK = np.zeros((*np.shape(length), 6, 6))
    by_phi = (THICK - SLENDER) / (1 + phi) ** 2
    dK[BENDING] = EI / L**3 * by_phi * 12.0 * radius2 / L**2 * per_length(length)
    return dK
