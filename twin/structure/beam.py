"""Beam elements on the neutral axis: three degrees of freedom a node (u, v, theta)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

__all__ = ["beam_mass", "beam_stiffness", "curvature_shape", "deflection_shape", "slope_shape"]


def beam_stiffness(*, EA: float, EI: float, length: float, shear_ratio: float = 0.0) -> NDArray[np.float64]:
    """Stiffness of a beam element, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    EA, EI
        Axial (N) and bending (N m2) stiffness of the section.
    length
        Of the element, m.
    shear_ratio
        E / (kappa G).  Zero is Euler-Bernoulli, otherwise Timoshenko with the exact static shape functions.

    Returns
    -------
    ndarray, (6, 6)
    """
    L = length
    phi = 12.0 * EI / EA * shear_ratio / L**2
    a, b = EA / L, EI / (1.0 + phi) / L**3
    K = np.zeros((6, 6))
    K[np.ix_([0, 3], [0, 3])] = a * np.array([[1.0, -1.0], [-1.0, 1.0]])
    K[np.ix_([1, 2, 4, 5], [1, 2, 4, 5])] = b * np.array(
        [
            [12.0, 6 * L, -12.0, 6 * L],
            [6 * L, (4 + phi) * L**2, -6 * L, (2 - phi) * L**2],
            [-12.0, -6 * L, 12.0, -6 * L],
            [6 * L, (2 - phi) * L**2, -6 * L, (4 + phi) * L**2],
        ]
    )
    return K


def beam_mass(*, mass_per_length: float, length: float, rotary: float = 0.0) -> NDArray[np.float64]:
    """Consistent mass of a beam element, DOFs (u1, v1, theta1, u2, v2, theta2).

    Parameters
    ----------
    mass_per_length
        kg/m.
    length
        Of the element, m.
    rotary
        Rotary inertia per length, rho I in kg m; zero leaves it out.

    Returns
    -------
    ndarray, (6, 6)
    """
    L, m = length, mass_per_length * length
    M = np.zeros((6, 6))
    M[np.ix_([0, 3], [0, 3])] = m / 6.0 * np.array([[2.0, 1.0], [1.0, 2.0]])
    bending = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    M[bending] = (
        m
        / 420.0
        * np.array(
            [
                [156.0, 22 * L, 54.0, -13 * L],
                [22 * L, 4 * L**2, 13 * L, -3 * L**2],
                [54.0, 13 * L, 156.0, -22 * L],
                [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
            ]
        )
    )
    M[bending] += (
        rotary
        / (30.0 * L)
        * np.array(
            [
                [36.0, 3 * L, -36.0, 3 * L],
                [3 * L, 4 * L**2, -3 * L, -(L**2)],
                [-36.0, -3 * L, 36.0, -3 * L],
                [3 * L, -(L**2), -3 * L, 4 * L**2],
            ]
        )
    )
    return M


def deflection_shape(xi: float, length: float) -> NDArray[np.float64]:
    """Hermite functions of (v1, theta1, v2, theta2) for the deflection v at `xi` in 0..1."""
    return np.array(
        [
            1 - 3 * xi**2 + 2 * xi**3,
            length * (xi - 2 * xi**2 + xi**3),
            3 * xi**2 - 2 * xi**3,
            length * (xi**3 - xi**2),
        ]
    )


def slope_shape(xi: float, length: float) -> NDArray[np.float64]:
    """Derivative of :func:`deflection_shape` with respect to x: the slope v' at `xi` in 0..1."""
    return np.array(
        [
            (6 * xi**2 - 6 * xi) / length,
            1 - 4 * xi + 3 * xi**2,
            (6 * xi - 6 * xi**2) / length,
            3 * xi**2 - 2 * xi,
        ]
    )


def curvature_shape(xi: float, length: float) -> NDArray[np.float64]:
    """Second derivative of :func:`deflection_shape` with respect to x: the curvature v'' at `xi` in 0..1."""
    return np.array(
        [
            (12 * xi - 6) / length**2,
            (6 * xi - 4) / length,
            (6 - 12 * xi) / length**2,
            (6 * xi - 2) / length,
        ]
    )
