"""Timoshenko's beam element: exact static shape functions, consistent mass, and derivatives by the shear ratio.

With phi = 12 EI s / (EA L^2) and s = E / (kappa G), deflection and section rotation are rational in phi alone,
(a(xi) + phi b(xi)) / (1 + phi), so that their derivative by phi is (b - a) / (1 + phi)^2.  Polynomials as in
Przemieniecki, Theory of Matrix Structural Analysis (1968), chapter 11.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["shear_parameter", "timoshenko_mass", "timoshenko_mass_derivative", "timoshenko_stiffness_derivative"]

Matrix = NDArray[np.float64]
BENDING = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
_POINTS, _WEIGHTS = np.polynomial.legendre.leggauss(4)
_XI, _WEIGHT = (_POINTS + 1) / 2, _WEIGHTS / 2
"""Four Gauss points integrate the squares of cubics exactly."""


def shear_parameter(*, radius2: float, shear_ratio: float, length: float) -> float:
    """The element's phi, from the section's I/A (`radius2`, m2), s = E/(kappa G) and the element's length (m)."""
    return 12.0 * radius2 * shear_ratio / length**2


def timoshenko_mass(*, mass_per_length: float, radius2: float, length: float, shear_ratio: float) -> Matrix:
    """Consistent mass with rotary inertia, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    mass_per_length
        kg/m.
    radius2
        I/A of the section, m2.
    length
        Of the element, m.
    shear_ratio
        E / (kappa G); zero leaves Rayleigh's beam: no shear deformation, but rotary inertia.

    Returns
    -------
    ndarray, (6, 6)
    """
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=length)
    m = mass_per_length * length
    M = np.zeros((6, 6))
    M[np.ix_([0, 3], [0, 3])] = m / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    for factor, (a, b) in ((1.0, _deflection(length)), (radius2, _rotation(length))):
        N = (a + phi * b) / (1 + phi)
        M[BENDING] += m * factor * (N.T * _WEIGHT) @ N
    return M


def timoshenko_mass_derivative(*, mass_per_length: float, radius2: float, length: float, shear_ratio: float) -> Matrix:
    """Derivative of :func:`timoshenko_mass` with respect to `shear_ratio`, (6, 6)."""
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=length)
    dphi = 12.0 * radius2 / length**2
    m = mass_per_length * length
    dM = np.zeros((6, 6))
    for factor, (a, b) in ((1.0, _deflection(length)), (radius2, _rotation(length))):
        N, dN = (a + phi * b) / (1 + phi), (b - a) / (1 + phi) ** 2
        product = (dN.T * _WEIGHT) @ N
        dM[BENDING] += m * factor * dphi * (product + product.T)
    return dM


def timoshenko_stiffness_derivative(*, EI: float, radius2: float, length: float, shear_ratio: float) -> Matrix:
    """Derivative of the element's stiffness with respect to `shear_ratio` at a given EI (N m2), (6, 6)."""
    L = length
    phi = shear_parameter(radius2=radius2, shear_ratio=shear_ratio, length=L)
    slender = np.array(
        [
            [12.0, 6 * L, -12.0, 6 * L],
            [6 * L, 4 * L**2, -6 * L, 2 * L**2],
            [-12.0, -6 * L, 12.0, -6 * L],
            [6 * L, 2 * L**2, -6 * L, 4 * L**2],
        ]
    )
    thick = np.zeros((4, 4))
    thick[np.ix_([1, 3], [1, 3])] = L**2 * np.array([[1.0, -1.0], [-1.0, 1.0]])
    dK = np.zeros((6, 6))
    dK[BENDING] = EI / L**3 * (thick - slender) / (1 + phi) ** 2 * 12.0 * radius2 / L**2
    return dK


def _deflection(length: float) -> tuple[Matrix, Matrix]:
    """Polynomials a, b of the deflection at the Gauss points, each (points, 4)."""
    x, L = _XI, length
    a = [1 - 3 * x**2 + 2 * x**3, L * (x - 2 * x**2 + x**3), 3 * x**2 - 2 * x**3, L * (x**3 - x**2)]
    b = [1 - x, L * (x - x**2) / 2, x, L * (x**2 - x) / 2]
    return np.stack(a, axis=1), np.stack(b, axis=1)


def _rotation(length: float) -> tuple[Matrix, Matrix]:
    """Polynomials a, b of the section's rotation at the Gauss points, each (points, 4)."""
    x, L = _XI, length
    a = [6 * (x**2 - x) / L, 1 - 4 * x + 3 * x**2, 6 * (x - x**2) / L, 3 * x**2 - 2 * x]
    b = [0 * x, 1 - x, 0 * x, x]
    return np.stack(a, axis=1), np.stack(b, axis=1)
